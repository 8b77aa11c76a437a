/*
  The both-sides coupling takes the polymer's force and the velocity in it from the last steps (docs/theory.md, V4). Pure C.
*/
#ifndef DLM_LAG_H
#define DLM_LAG_H

/* Weights of the differences to the step before, uniform steps: force * (f - f_before), and, within f, velocity * (u - u_before). Order 2: 1/2 and 1/2. */
typedef struct {
  double force, velocity;
} DLMLag;

/*
  Are all roots of the step of one flow mode smaller than radius? In units of the implicit viscosity mu_i, velocity_part: mu_i - mu; stress_part: eta times by
  how much stretched polymer answers more than polymer at rest; seen: the part of the mode that the projected gradient sees; decay = 1 - exp(-dt/lambda1).
*/
int DLMLagDamps(double velocity_part, double stress_part, double seen, double decay, DLMLag lag, double radius);
/* The largest weights, up to second order's, that damp every mode with a margin; stress_part: of polymer at rest; stiffness: that of stretched polymer over it; step = dt/lambda1. */
DLMLag DLMLagChoose(double velocity_part, double stress_part, double stiffness, double step);
#endif
