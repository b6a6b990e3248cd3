static void sense(NAME_memory *m)
{
    for (int i = 0; i < SENSORS; i++) {
        m->sensed[i] = SENSOR_OFFSET[i] + dot(SENSOR_ROWS + i * UNKNOWNS, m->now.x, UNKNOWNS);
        m->sensed_rates[i] = dot(SENSOR_ROWS + i * UNKNOWNS, m->now.v, UNKNOWNS);
    }
}
