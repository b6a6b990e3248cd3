static void sense(NAME_memory *m)
{
    for (int i = 0; i < SENSORS; i++) {
        m->sensed[i] = @own_sensor_offset@[i] + dot(@own_sensor_rows@ + i * UNKNOWNS, @state_x@, UNKNOWNS);
        m->sensed_rates[i] = dot(@own_sensor_rows@ + i * UNKNOWNS, @state_v@, UNKNOWNS);
    }
}
