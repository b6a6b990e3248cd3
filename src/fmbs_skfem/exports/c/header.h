/* TITLE
 *
 * DESCRIPTION
 * Written by fmbs_skfem VERSION. C99, no library, no memory but NAME_memory.
 *
 *     static NAME_memory model;
 *     double outputs[NAME_OUTPUTS];
 *     NAME_init(&model);      parameters and inputs have their start values, and may be changed
 *     NAME_start(&model);
 *     model.inputs[...] = ...;
 *     NAME_step(&model, NAME_STEP);
 *     NAME_outputs(&model, outputs);
 *
 * The state is in NAME_memory: a copy of it is a saved state, and two of them are two models.
 */
#ifndef NAME_H
#define NAME_H

#ifdef __cplusplus
extern "C" {
#endif

#define NAME_INTERFACE 2 /* version of this header: new fields and statuses */
#define NAME_STEP STEP /* of the model [s] */
#define NAME_PARAMETERS N_PARAMETERS
#define NAME_INPUTS N_INPUTS
#define NAME_OUTPUTS N_OUTPUTS

PORTS
typedef enum {
    NAME_OK,
    NAME_INPUT_NOT_FINITE,
    NAME_SPAN_NOT_POSITIVE,
    NAME_NOT_CONVERGED,
    NAME_NOT_FINITE,
    NAME_SINGULAR,
    NAME_NO_SUCH_INPUT,
    NAME_PARAMETER_OUTSIDE,
    NAME_NO_DERIVATIVE,
    NAME_TOO_FEW_CORRECTIONS,
    NAME_INPUT_OUTSIDE
} NAME_status;

/* An accepted state: unknowns, rates, algorithmic accelerations, accelerations, c times multipliers, earlier ones. */
typedef struct {
    double x[N_], v[N_], a[N_], acceleration[N_], multipliers[M_], history[3][N_], past[3][M_];
    double kept[K_], turned[T_], change;
    int known, order;
} NAME_state;

typedef struct {
    double parameters[P_]; /* given by the caller before the start */
    double inputs[I_];     /* and before a step */
    int outside[I_];       /* whether an input was beyond the range of the training, of which the first step says so */
    int fixed;             /* corrections of every step; 0: as many as the tolerance asks for */
    double time;           /* [s] */
    double since;          /* the time is this plus `whole` steps of the model: sums of steps drift by their round-off [s] */
    long long whole;
    long long steps, corrections, factorisations, divided;
    double left; /* size of the last of `fixed` corrections [m] */
    int enough;  /* where these are too few: how many would do; 0: shorter steps alone */
    /* inputs that drive joints: values at the ends of the last four spans, and the cubic through them with its derivatives */
    double given[4][D_], smooth[4][D_], given_end, given_span;
    NAME_state now, before; /* before: that of the begin of a step that is divided */
    /* the method */
    double h, c, bh, gh, sharp, largest_mass;
    /* the trial state and what is evaluated there */
    double trial_x[N_], trial_v[N_], trial_acceleration[N_], trial_multipliers[M_];
    double signals[S_], rhs[R_], y[J_], rates[J_], g[J_], Jy[M_][J_], path_y[J_], path_z[J_], path_v[J_], path_a[J_];
    double sensed[O_], sensed_rates[O_];
    double room[3][ROOM_], moduli[MODULI_], turned_tangents[C_];
NUMBERS
    /* factors */
    double W[ENTRIES_], J[M_][N_], spread[M_][N_], schur[MM_], pull;
    double updates[Q_][R_], shares[Q_][N_], moved[N_], moved_twice[R_];
    int pivots[N_], schur_pivots[M_], factored, age, secants, turning, judging;
} NAME_memory;

/* Start values of parameters and inputs. */
void NAME_init(NAME_memory *m);
/* The start of the motion at these parameters, t = 0. */
NAME_status NAME_start(NAME_memory *m);
/* Go on by a span of time [s], in steps of the model, or shorter ones where the span is no multiple of these. */
NAME_status NAME_step(NAME_memory *m, double span);
/* All outputs of the present state, NAME_OUTPUTS of them. */
void NAME_outputs(NAME_memory *m, double out[]);
/* Energies of the present state, of motion, and of strains and springs [J]. */
double NAME_kinetic_energy(NAME_memory *m);
double NAME_strain_energy(NAME_memory *m);
/* Derivatives of all outputs by an input that changes in the last step. */
NAME_status NAME_derivative(NAME_memory *m, int input, double out[]);
/* What a status means. */
const char *NAME_message(NAME_status status);

#ifdef __cplusplus
}
#endif

#endif
