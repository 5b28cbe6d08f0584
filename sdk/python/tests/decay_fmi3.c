/* A state x that decays with the rate k and is driven by u, as a co-simulation FMU of FMI 3: dx/dt = -k x + u, y = x. Each step is
   exact for a held input. Variables by value reference: 0 time, 1 k, 2 u, 3 x, 4 der(x), 5 y. What is not used here is made of
   empty functions by the test. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>

typedef struct { double v[6]; } Unit;
typedef unsigned int Ref;

static void fresh(Unit *unit) {
  static const double starts[6] = {0.0, 2.0, 0.0, 1.0, 0.0, 1.0};
  for (int i = 0; i < 6; i++) unit->v[i] = starts[i];
}

void *fmi3InstantiateCoSimulation(void) {
  Unit *unit = malloc(sizeof(Unit));
  fresh(unit);
  return unit;
}
void fmi3FreeInstance(Unit *unit) { free(unit); }
int fmi3Reset(Unit *unit) { fresh(unit); return 0; }
int fmi3EnterInitializationMode(Unit *unit, bool d, double tolerance, double start, bool s, double stop) {
  unit->v[0] = start;
  return 0;
}
int fmi3SetFloat64(Unit *unit, const Ref *refs, size_t n, const double *values, size_t n_values) {
  for (size_t i = 0; i < n; i++) {
    if (refs[i] > 3) return 3;
    unit->v[refs[i]] = values[i];
  }
  return 0;
}
int fmi3GetFloat64(Unit *unit, const Ref *refs, size_t n, double *values, size_t n_values) {
  unit->v[5] = unit->v[3];
  for (size_t i = 0; i < n; i++) values[i] = unit->v[refs[i]];
  return 0;
}
int fmi3DoStep(Unit *unit, double t, double h, bool kept, bool *event, bool *ended, bool *early, double *reached) {
  double k = unit->v[1], rest = unit->v[2] / k;
  if (fabs(t - unit->v[0]) > 1e-9) return 3;
  unit->v[3] = rest + (unit->v[3] - rest) * exp(-k * h);
  unit->v[0] = *reached = t + h;
  *event = *ended = *early = false;
  return 0;
}
