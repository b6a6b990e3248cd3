/* ---------------------------------------------------------------------------------------------------------------------------------
 * One step of generalized-alpha for index-3 DAEs (Arnold and Bruels, Multibody Syst. Dyn. 18 (2007) 185-202):
 *
 *     (1 - am) a1 + am a0 = (1 - af) q1'' + af q0''
 *     q1 = q0 + h q0' + h^2 (1/2 - beta) a0 + h^2 beta a1,     q1' = q0' + h (1 - gamma) a0 + h gamma a1
 *     [ c W      J^T ] [ dq ]     [ c (M q'' + C q' + K q + f - Q) + J^T lambda ]
 *     [ J        0   ] [ dl ] = - [ Phi                                          ],   W = bh M + gh C + K + df/dq,   c = h^2 beta
 *
 * lambda is c times the multipliers in newtons. Factors of the matrix serve as long as the iteration contracts well.
 * ------------------------------------------------------------------------------------------------------------------------------ */

#define NONE (-1)
#define EACH(i, n) for (int i = 0; i < (n); i++)

enum outcome { DONE, NOT_CONVERGED, DIVERGED, NOT_A_NUMBER, SINGULAR, TOO_FEW };

/* W += P^T H P of one pair of rows, where both are in the same block. */
static void add_pair(NAME_memory *m, int row, int column, double value)
{
    const double *p = PROBE_ROWS + PROBE_FIRST[row], *q = PROBE_ROWS + PROBE_FIRST[column];
    const int many = PROBE_FIRST[row + 1] - PROBE_FIRST[row], others = PROBE_FIRST[column + 1] - PROBE_FIRST[column];
    if (value == 0.0)
        return;
    EACH (b, BLOCKS) {
        const int first = BLOCK[b], last = BLOCK[b + 1], size = last - first;
        EACH (j, others) {
            const int l = PROBE_BEGIN[column] + j;
            double *target = m->W + BLOCK_AT[b] + (l - first) * size;
            const double factor = value * q[j];
            if (l < first || l >= last || factor == 0.0)
                continue;
            EACH (i, many) {
                const int k = PROBE_BEGIN[row] + i;
                if (k >= first && k < last)
                    target[k - first] += p[i] * factor;
            }
        }
    }
}
