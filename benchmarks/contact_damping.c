/* Equations (1)-(10) of the article, written out once more, with damping in the contact. */
#include <math.h>

typedef struct {
    double model, m, w, h, I, k1, k2, L1, L2, F_n, alpha1, alpha2, y0;
    double k3, k4;      /* of B2: k3 is k_c */
    double mu, V;
    double a;           /* s/m: each contact point bears with k p max(0, 1 + a dp/dt) */
    double C[9];        /* damping matrix in (x, y, theta) */
    double reference;   /* C acts in proportion to the contact force over this; 0: everywhere */
} Brake;

static double bears(const Brake *b, double k, double gap, double rate)
{
    double factor = 1.0 - b->a * rate;
    return gap < 0.0 && factor > 0.0 ? -k * gap * factor : 0.0;
}

/* Rates (6) of a state (x, y, theta, and theirs), the gaps of both edges and the contact force. */
void rates(const Brake *b, const double *z, double *out, double *gaps, double *force)
{
    double d = hypot(b->w, b->h), beta = asin(b->h / d), x = z[0], y = z[1], th = z[2];
    double sp = sin(beta + th), cp = cos(beta + th), sm = sin(beta - th), cm = cos(beta - th);
    double u1 = x - d * cm + b->w - b->L1 * cos(b->alpha1);
    double w1 = y + d * sm - b->h - b->L1 * sin(b->alpha1);
    double u2 = x + d * cp - b->w + b->L2 * cos(b->alpha2);
    double w2 = y + d * sp - b->h - b->L2 * sin(b->alpha2);
    double r1 = hypot(u1, w1), r2 = hypot(u2, w2);
    double f1 = -b->k1 * (r1 - b->L1) / r1, f2 = -b->k2 * (r2 - b->L2) / r2;
    double fx = f1 * u1 + f2 * u2, fy = f1 * w1 + f2 * w2 - b->F_n;
    double moment = -f1 * u1 * d * sm - f1 * w1 * d * cm - f2 * u2 * d * sp + f2 * w2 * d * cp;
    double gl = b->y0 + y + b->h - d * sp, gt = b->y0 + y + b->h - d * sm;
    double vl = z[4] - d * cp * z[5], vt = z[4] + d * cm * z[5], N = 0.0;
    if (b->model == 1.0) {
        double F3 = bears(b, b->k3, gl, vl), F4 = bears(b, b->k4, gt, vt);
        N = F3 + F4;
        moment += -F3 * d * cp + F4 * d * cm + b->mu * d * (F3 * sp + F4 * sm);
    } else if (gl < 0.0 || gt < 0.0) {
        double low = gl > 0.0 ? (gl + gt) / (gl - gt) : -1.0;
        double high = gt > 0.0 ? (gl + gt) / (gl - gt) : 1.0;
        double middle = (low + high) / 2.0, half = (high - low) / 2.0;
        for (int i = -1; i < 2; i += 2) { /* two points are exact for a cubic */
            double s = middle + i * half / sqrt(3.0), A = (1.0 - s) / 2.0, B = (1.0 + s) / 2.0;
            double F = half * bears(b, 0.5 * b->k3, A * gl + B * gt, A * vl + B * vt);
            N += F;
            moment += F * (-A * d * cp + B * d * cm);
        }
        moment += b->mu * N * b->h;
    }
    fx += b->mu * N;
    fy += N;
    double share = b->reference > 0.0 ? N / b->reference : 1.0, load[3] = {fx, fy, moment};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            load[i] -= share * b->C[3 * i + j] * z[3 + j];
    for (int i = 0; i < 3; i++) {
        out[i] = z[3 + i];
        out[3 + i] = load[i] / (i < 2 ? b->m : b->I);
    }
    gaps[0] = gl;
    gaps[1] = gt;
    *force = N;
}

/* Moves z by n steps of Runge and Kutta; seen: share of time with a separated edge, greatest
   contact force, greatest speed of the lower face in contact. */
void march(const Brake *b, double *z, long n, double h, double *seen)
{
    double k[4][6], at[6], gaps[2], N, none[2], no;
    long lost = 0;
    seen[1] = seen[2] = 0.0;
    for (long step = 0; step < n; step++) {
        rates(b, z, k[0], gaps, &N);
        lost += gaps[0] > 0.0 || gaps[1] > 0.0;
        seen[1] = fmax(seen[1], N);
        if (N > 0.0)
            seen[2] = fmax(seen[2], z[3] + b->h * z[5]);
        for (int s = 1; s < 4; s++) {
            for (int j = 0; j < 6; j++)
                at[j] = z[j] + (s < 3 ? h / 2.0 : h) * k[s - 1][j];
            rates(b, at, k[s], none, &no);
        }
        for (int j = 0; j < 6; j++)
            z[j] += h / 6.0 * (k[0][j] + 2.0 * (k[1][j] + k[2][j]) + k[3][j]);
    }
    seen[0] = (double)lost / n;
}
