// A Taylor integrator of model B1 written out by hand: what little there is to save beside
// squeal's default path. Reads a scaled pad and a first state, prints the median processor time of a
// run, the steps, the contact changes and the place at the end. See floor.py.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <vector>

constexpr int N = ORDER;  // of the series
using Series = double[N + 1];

struct Spring { double k, L, Dx, Dy, rx, ry; };
struct Edge { double k, rx, ry; };

static Spring spring[2];
static Edge edge[2];
static double m, I, mu, load, stop;

static inline double product(const double *a, const double *b, int k) {
    double sum = 0;
    for (int j = 0; j <= k; ++j) sum += a[j] * b[k - j];
    return sum;
}

struct Motion {
    Series x, y, t, u, v, r, s, c, gap[2];  // s = sin(theta), c = cos(theta) - 1
    Series cosine, ax, ay, vx, vy, square, length, below, f, fx, fy, force, lever;
    struct Part { Series ax, ay, vx, vy, length, below, f, fx, fy; } part[2];
    struct Touch { Series force, lever; } touch[2];

    // all coefficients from the first ones, with the edges that touch
    void expand(const bool on[2]) {
        for (int k = 0; k < N; ++k) {
            if (k == 0) {
                const double half = std::sin(0.5 * t[0]);
                s[0] = std::sin(t[0]);
                c[0] = -2 * half * half;
                cosine[0] = 1 + c[0];
            } else {
                double ds = 0, dc = 0;
                for (int j = 1; j <= k; ++j) {
                    ds += j * t[j] * cosine[k - j];
                    dc -= j * t[j] * s[k - j];
                }
                s[k] = ds / k;
                c[k] = cosine[k] = dc / k;
            }
            double X = 0, Y = k ? 0 : -load, M = 0;
            for (int i = 0; i < 2; ++i) {
                const Spring &p = spring[i];
                Part &q = part[i];
                const double ox = c[k] * p.rx - s[k] * p.ry, oy = s[k] * p.rx + c[k] * p.ry;
                q.ax[k] = ox + (k ? 0 : p.rx);
                q.ay[k] = oy + (k ? 0 : p.ry);
                const double ux = x[k] + ox, uy = y[k] + oy;
                q.vx[k] = ux + (k ? 0 : p.Dx);
                q.vy[k] = uy + (k ? 0 : p.Dy);
                const double sq = product(q.vx, q.vx, k) + product(q.vy, q.vy, k);
                double stretch = sq;
                if (k == 0) {
                    q.length[0] = std::sqrt(sq);
                    stretch = 2 * (p.Dx * ux + p.Dy * uy) + ux * ux + uy * uy;
                } else {
                    double rest = sq;
                    for (int j = 1; j < k; ++j) rest -= q.length[j] * q.length[k - j];
                    q.length[k] = rest / (2 * q.length[0]);
                }
                q.below[k] = sq + p.L * q.length[k];
                double top = -p.k * stretch;
                for (int j = 1; j <= k; ++j) top -= q.below[j] * q.f[k - j];
                q.f[k] = top / q.below[0];
                q.fx[k] = product(q.f, q.vx, k);
                q.fy[k] = product(q.f, q.vy, k);
                X += q.fx[k];
                Y += q.fy[k];
                M += product(q.ax, q.fy, k) - product(q.ay, q.fx, k);
            }
            for (int i = 0; i < 2; ++i) {
                const Edge &p = edge[i];
                const double ox = c[k] * p.rx - s[k] * p.ry, oy = s[k] * p.rx + c[k] * p.ry;
                gap[i][k] = y[k] + oy;
                if (!on[i]) continue;
                touch[i].force[k] = -p.k * gap[i][k];
                touch[i].lever[k] = ox - mu * oy + (k ? 0 : p.rx - mu * p.ry);
                X += mu * touch[i].force[k];
                Y += touch[i].force[k];
                M += product(touch[i].lever, touch[i].force, k);
            }
            x[k + 1] = u[k] / (k + 1);
            y[k + 1] = v[k] / (k + 1);
            t[k + 1] = r[k] / (k + 1);
            u[k + 1] = X / m / (k + 1);
            v[k + 1] = Y / m / (k + 1);
            r[k + 1] = M / I / (k + 1);
        }
    }

    double step() const {
        double least = 1e300;
        for (int k : {N - 1, N}) {
            double top = 0, size = 0;
            for (const double *a : {x, y, t, u, v, r}) {
                top = std::max(top, std::fabs(a[k]));
                size = std::max(size, std::fabs(a[0]));
            }
            if (top > 0) least = std::min(least, std::pow(size / top, 1.0 / k));
        }
        return least * std::exp(-2.0 - 0.7 / (N - 1));
    }
};

static double value(const double *a, double h, int last) {
    double sum = a[last];
    for (int k = last; k-- > 0;) sum = sum * h + a[k];
    return sum;
}

// the first root of a gap in (0, h] towards `sense`, h + 1 if there is none
static double root(const double *gap, double h, double sense) {
    constexpr int PARTS = 8, LAST = N - 1;
    double low = 0;
    for (int i = 1; i <= PARTS; ++i) {
        const double high = h * i / PARTS;
        if (sense * value(gap, high, LAST) > 0) {
            double a = low, b = high, at = 0.5 * (a + b);
            for (int n = 0; n < 60; ++n) {
                double g = gap[LAST], d = 0;
                for (int k = LAST; k-- > 0;) { d = d * at + g; g = g * at + gap[k]; }
                (sense * g > 0 ? b : a) = at;
                double next = at - g / d;
                if (!(next > a && next < b)) next = 0.5 * (a + b);
                if (std::fabs(next - at) < 1e-16 * h) break;
                at = next;
            }
            return at;
        }
        low = high;
    }
    return h + 1;
}

static double processor_time() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

int main() {
    double state[6];
    int count, first[2], repeats;
    if (std::scanf("%d %d", &count, &repeats) != 2 || count != 1) return 2;
    if (std::scanf("%lf %lf %lf %lf %lf", &m, &I, &mu, &load, &stop) != 5) return 2;
    for (Spring &p : spring)
        if (std::scanf("%lf %lf %lf %lf %lf %lf", &p.k, &p.L, &p.Dx, &p.Dy, &p.rx, &p.ry) != 6) return 2;
    for (Edge &p : edge)
        if (std::scanf("%lf %lf %lf", &p.k, &p.rx, &p.ry) != 3) return 2;
    for (double &q : state)
        if (std::scanf("%lf", &q) != 1) return 2;
    double on[2];
    if (std::scanf("%lf %lf", &on[0], &on[1]) != 2) return 2;
    for (int i = 0; i < 2; ++i) first[i] = on[i] != 0;
    static Motion w;
    double *parts[6] = {w.x, w.y, w.t, w.u, w.v, w.r};
    std::vector<double> spent;
    int steps = 0, changes = 0;
    for (int n = 0; n < repeats; ++n) {
        const double begun = processor_time();
        bool on[2] = {first[0] != 0, first[1] != 0};
        for (int i = 0; i < 6; ++i) parts[i][0] = state[i];
        double now = 0;
        steps = changes = 0;
        while (now < stop) {
            w.expand(on);
            double h = std::min(w.step(), stop - now);
            int met = -1;
            for (int i = 0; i < 2; ++i) {
                const double at = root(w.gap[i], h, on[i] ? 1 : -1);
                if (at <= h) { h = at; met = i; }
            }
            for (double *a : parts) a[0] = value(a, h, N);
            now += h;
            ++steps;
            if (met >= 0) { on[met] = !on[met]; ++changes; }
        }
        spent.push_back(processor_time() - begun);
    }
    std::nth_element(spent.begin(), spent.begin() + repeats / 2, spent.end());
    std::printf("%.9e %d\n", spent[repeats / 2], steps);
    std::printf("%d %.17g %.17g %.17g\n", changes, w.x[0], w.y[0], w.t[0]);
}
