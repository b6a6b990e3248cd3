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
#ifndef NAME_HEADER_IS_READ
#define NAME_HEADER_IS_READ

#ifdef __cplusplus
extern "C" {
#endif

#define NAME_INTERFACE 5 /* version of this header: new fields and statuses */
#define NAME_STEP STEP /* of the model [s] */
#define NAME_PARAMETERS N_PARAMETERS
#define NAME_INPUTS N_INPUTS
#define NAME_OUTPUTS N_OUTPUTS
#define NAME_EVENTS N_EVENTS

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
    NAME_INPUT_OUTSIDE,
    NAME_CONTROLLER_NOT_FINITE,
    NAME_PARAMETER_FIXED,
    NAME_EVENT,
    NAME_STOPPED,
    NAME_EVENT_NOT_FINITE,
    NAME_EVENTS_ENDLESS,
    NAME_EVENT_CONTRADICTED
} NAME_status;

typedef struct {
    double parameters[P_]; /* given by the caller before the start; tunable ones before a step as well */
    double inputs[I_];     /* and before a step: from its begin on; behind those of the caller stands what controllers give, and locks hold */
    double rates[3][I_];   /* derivatives of inputs by time at the begin of a step [1/s, 1/s2, 1/s3]; 0 again when it is taken */
    int outside[I_];       /* whether an input was beyond the range of the training, of which the first step says so */
    int fixed;             /* corrections of every step; 0: as many as the tolerance asks for */
    int pause;             /* whether a step ends where an event happens, and says so by NAME_EVENT */
    double time;           /* [s] */
    double since;          /* the time is this plus `whole` steps of the model: sums of steps drift by their round-off [s] */
    long long whole;
    long long samples[C_]; /* of controllers so far */
    int jump; /* number of the next instant at which loads jump */
    long long happened[E_]; /* how often each event has happened so far */
    double instant;         /* of the last one [s] */
    double step_begin, step_end, kept_time[3], apart; /* of the search for events [s] */
    int kept_jump[3];
    long long steps, corrections, factorisations, divided;
    double left; /* size of the last of `fixed` corrections [m] */
    int enough;  /* where these are too few: how many would do; 0: shorter steps alone */
    double told;                  /* when inputs were given last [s] */
    double given_end, given_span; /* of the last step [s] */
    double acting[I_];            /* inputs now */
    double acting_parameters[P_]; /* parameters now */
    /* those that drive joints: values at the ends of the last four spans, and the cubic through them with its derivatives */
    double given[4][D_], smooth[4][D_];
    double begun[B_];              /* x, v, q'' and multipliers at the begin of the last step of the model */
    double turned[T_], sensed[O_], sensed_rates[O_]; /* angles with their turns, and what outputs read */
    /* what the kernels of a step write: the state, the trial state, factors, and rooms */
FIELDS
} NAME_memory;

/* Start values of parameters and inputs. */
void NAME_init(NAME_memory *m);
/* The start of the motion at these parameters, t = 0. */
NAME_status NAME_start(NAME_memory *m);
/* Go on by a span of time [s], in steps of the model, or shorter ones where the span is no multiple of these.
 *
 * With `fixed` corrections the work is bounded: a step makes one factorisation, evaluates forces and solves `fixed` times, and solves
 * twice more for velocities of joints that move. Where a controller gives another value, and where loads jump, forces are evaluated,
 * factorised and solved once more; each jump of loads inside of a step makes two steps of it. */
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
