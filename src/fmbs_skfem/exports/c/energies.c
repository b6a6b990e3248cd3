static double quadratic(const double *A, const double *x)
{
    double total = 0.0;
    EACH (b, BLOCKS) {
        const int first = BLOCK[b], size = BLOCK[b + 1] - first;
        EACH (j, size)
            total += 0.5 * x[first + j] * dot(A + j * size, x + first, size);
        A += size * size;
    }
    return total;
}

double NAME_kinetic_energy(NAME_memory *m)
{
    return quadratic(MASS, m->now.v);
}

double NAME_strain_energy(NAME_memory *m)
{
    read_rows(m, m->now.x, 1, m->y);
    double energy = HAS_SPRINGS ? quadratic(SPRINGS, m->now.x) : 0.0;
    ENERGIES
    return energy;
}
