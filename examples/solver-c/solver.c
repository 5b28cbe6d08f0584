/* Temperature of a steel plate in a quenching bath: half of its thickness in finite volumes, heat conducted inside,
 * convected at the surface. Reads params.txt, writes result.csv. Compile: cc -O2 -o solver solver.c -lm */
#include <math.h>
#include <stdio.h>

#define CELLS 40
static const double HALF = 0.02;          /* half the thickness, m */
static const double RHO_C = 3.6e6;        /* heat capacity per volume, J/(m^3 K) */
static const double BATH = 20.0;          /* temperature of the bath, degC */
static const double STEP = 0.001;         /* s; stable up to a conductivity of 400 W/(m K) */
static const int STEPS_PER_ROW = 500;

int main(void) {
    double k, h, end, plate, t[CELLS], flux[CELLS + 1];
    const double dx = HALF / CELLS;

    FILE *in = fopen("params.txt", "r");
    if (!in || fscanf(in, "k %lf h %lf plate %lf end %lf", &k, &h, &plate, &end) != 4) {
        fprintf(stderr, "params.txt does not hold k, h, plate and end\n");
        return 1;
    }
    fclose(in);
    if (k <= 0.0 || h <= 0.0 || 2.0 * k * STEP > RHO_C * dx * dx) {
        fprintf(stderr, "no stable step for k = %g, h = %g\n", k, h);
        return 2;
    }

    FILE *out = fopen("result.csv", "w");
    if (!out) {
        perror("result.csv");
        return 1;
    }
    fprintf(out, "time,centre,surface\n");
    for (int i = 0; i < CELLS; i++) t[i] = plate;
    /* From the middle of the last cell the heat passes half a cell of steel, then the film at the surface. */
    const double film = 1.0 / (0.5 * dx / k + 1.0 / h);
    const long steps = (long)ceil(end / STEP / STEPS_PER_ROW) * STEPS_PER_ROW;
    for (long n = 0; n <= steps; n++) {
        flux[0] = 0.0; /* the plate is symmetric */
        for (int i = 1; i < CELLS; i++) flux[i] = k * (t[i - 1] - t[i]) / dx;
        flux[CELLS] = film * (t[CELLS - 1] - BATH);
        if (n % STEPS_PER_ROW == 0) {
            /* The centre lies half a cell inside the first cell, where the profile is flat. */
            double centre = t[0] + (t[0] - t[1]) / 8.0;
            fprintf(out, "%.17g,%.17g,%.17g\n", n * STEP, centre, BATH + flux[CELLS] / h);
        }
        for (int i = 0; i < CELLS; i++) t[i] += STEP * (flux[i] - flux[i + 1]) / (RHO_C * dx);
    }
    return fclose(out) == 0 ? 0 : 1;
}
