// The integrator of floor.cpp with every loop unrolled, for one pad after the other (LANES = 1) or
// for as many at once as a vector has lanes, each with steps and contact changes of its own; a lane
// whose pad is done takes the next one. Reads scaled pads and their first states; prints the median
// processor time of a run over all of them, the steps, and of each pad its contact changes and its
// place at the end. See floor.py.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <utility>
#include <vector>

constexpr int N = ORDER;  // of the series
#if LANES == 1
using Lane = double;
using Mask = long;
static inline double &at(Lane &a, int) { return a; }
static inline double at(const Lane &a, int) { return a; }
static inline Lane choose(bool m, Lane a, Lane b) { return m ? a : b; }
static inline bool any(bool m) { return m; }
#else
typedef double Lane __attribute__((vector_size(8 * LANES)));
typedef long Mask __attribute__((vector_size(8 * LANES)));
static inline double &at(Lane &a, int i) { return reinterpret_cast<double *>(&a)[i]; }
static inline double at(const Lane &a, int i) { return a[i]; }
static inline Lane choose(Mask m, Lane a, Lane b) { return m ? a : b; }
static inline bool any(Mask m) {
    long all = 0;
    for (int i = 0; i < LANES; ++i) all |= m[i];
    return all != 0;
}
#endif
using Series = Lane[N + 1];

template <class F> static inline Lane each(F f, Lane a) {
    alignas(64) double in[LANES], out[LANES];
    for (int i = 0; i < LANES; ++i) in[i] = at(a, i);
    for (int i = 0; i < LANES; ++i) out[i] = f(in[i]);
    for (int i = 0; i < LANES; ++i) at(a, i) = out[i];
    return a;
}
static inline Lane constant(double v) { return Lane{} + v; }
static inline Lane magnitude(Lane a) { return choose(a < 0, -a, a); }
static inline Lane greater(Lane a, Lane b) { return choose(a > b, a, b); }
static inline Lane lesser(Lane a, Lane b) { return choose(a < b, a, b); }

struct Spring { Lane k, L, Dx, Dy, rx, ry; };
struct Edge { Lane k, rx, ry; };
struct Pads { Lane m, I, mu, load, stop; Spring spring[2]; Edge edge[2]; Lane state[6], on[2]; };
constexpr int NUMBERS = sizeof(Pads) / sizeof(Lane);

template <int K> static inline Lane product(const Lane *a, const Lane *b) {
    Lane sum = a[0] * b[K];
#pragma GCC unroll 32
    for (int j = 1; j <= K; ++j) sum += a[j] * b[K - j];
    return sum;
}
// the sum without its first and last term where `inner` is 1
template <int K> static inline Lane squared(const Lane *a, int inner = 0) {
    Lane sum{};
#pragma GCC unroll 32
    for (int j = inner; 2 * j < K; ++j) sum += a[j] * a[K - j];
    sum += sum;
    if (K % 2 == 0 && K / 2 >= inner) sum += a[K / 2] * a[K / 2];
    return sum;
}

struct Motion {
    Series x, y, t, u, v, r, s, c, gap[2];  // s = sin(theta), c = cos(theta) - 1
    Series cosine, turn;
    struct Part { Series ax, ay, vx, vy, length, below, f, fx, fy; Lane half, over; } part[2];
    struct Touch { Series force, lever; } touch[2];

    template <int k> inline void next(const Pads &p) {
        if constexpr (k == 0) {
            const Lane half = each([](double a) { return std::sin(a); }, 0.5 * t[0]);
            s[0] = each([](double a) { return std::sin(a); }, t[0]);
            c[0] = -2 * half * half;
            cosine[0] = 1 + c[0];
        } else {
            turn[k] = k * t[k];
            Lane ds = turn[k] * cosine[0], dc = turn[k] * s[0];
#pragma GCC unroll 32
            for (int j = 1; j < k; ++j) {
                ds += turn[j] * cosine[k - j];
                dc += turn[j] * s[k - j];
            }
            s[k] = ds * (1.0 / k);
            c[k] = cosine[k] = dc * (-1.0 / k);
        }
        Lane X{}, Y = k ? Lane{} : -p.load, M{};
#pragma GCC unroll 2
        for (int i = 0; i < 2; ++i) {
            const Spring &g = p.spring[i];
            Part &q = part[i];
            const Lane ox = c[k] * g.rx - s[k] * g.ry, oy = s[k] * g.rx + c[k] * g.ry;
            const Lane ux = x[k] + ox, uy = y[k] + oy;
            q.ax[k] = k ? ox : ox + g.rx;
            q.ay[k] = k ? oy : oy + g.ry;
            q.vx[k] = k ? ux : ux + g.Dx;
            q.vy[k] = k ? uy : uy + g.Dy;
            const Lane sq = squared<k>(q.vx) + squared<k>(q.vy);
            if constexpr (k == 0) {
                q.length[0] = each([](double a) { return std::sqrt(a); }, sq);
                q.half = 0.5 / q.length[0];
                q.below[0] = sq + g.L * q.length[0];
                q.over = 1 / q.below[0];
                const Lane stretch = 2 * (g.Dx * ux + g.Dy * uy) + ux * ux + uy * uy;
                q.f[0] = -g.k * stretch * q.over;
            } else {
                q.length[k] = (sq - squared<k>(q.length, 1)) * q.half;
                q.below[k] = sq + g.L * q.length[k];
                Lane top = -g.k * sq;
#pragma GCC unroll 32
                for (int j = 1; j <= k; ++j) top -= q.below[j] * q.f[k - j];
                q.f[k] = top * q.over;
            }
            q.fx[k] = product<k>(q.f, q.vx);
            q.fy[k] = product<k>(q.f, q.vy);
            X += q.fx[k];
            Y += q.fy[k];
            M += product<k>(q.ax, q.fy) - product<k>(q.ay, q.fx);
        }
#pragma GCC unroll 2
        for (int i = 0; i < 2; ++i) {
            const Edge &e = p.edge[i];
            const Lane ox = c[k] * e.rx - s[k] * e.ry, oy = s[k] * e.rx + c[k] * e.ry;
            gap[i][k] = y[k] + oy;
            if (LANES == 1 && !any(p.on[i] > 0)) continue;
            touch[i].force[k] = -p.on[i] * e.k * gap[i][k];
            touch[i].lever[k] = ox - p.mu * oy + (k ? Lane{} : e.rx - p.mu * e.ry);
            X += p.mu * touch[i].force[k];
            Y += touch[i].force[k];
            M += product<k>(touch[i].lever, touch[i].force);
        }
        constexpr double over = 1.0 / (k + 1);
        x[k + 1] = u[k] * over;
        y[k + 1] = v[k] * over;
        t[k + 1] = r[k] * over;
        u[k + 1] = X / p.m * over;
        v[k + 1] = Y / p.m * over;
        r[k + 1] = M / p.I * over;
    }

    // all coefficients from the first ones
    template <int... k> inline void expand(const Pads &p, std::integer_sequence<int, k...>) {
        (next<k>(p), ...);
    }

    Lane step() const {
        Lane least = constant(1e300), size{};
        for (const Lane *a : {x, y, t, u, v, r}) size = greater(size, magnitude(a[0]));
        for (int k : {N - 1, N}) {
            Lane top = constant(1e-300);
            for (const Lane *a : {x, y, t, u, v, r}) top = greater(top, magnitude(a[k]));
            const double power = 1.0 / k;
            least = lesser(least, each([=](double a) { return std::pow(a, power); }, size / top));
        }
        return least * std::exp(-2.0 - 0.7 / (N - 1));
    }
};

template <int LAST> static inline Lane value(const Lane *a, Lane h) {
    Lane sum = a[LAST];
#pragma GCC unroll 32
    for (int k = LAST - 1; k >= 0; --k) sum = sum * h + a[k];
    return sum;
}

// the first root of a gap in (0, h] towards `sense`, h + 1 if there is none
static inline Lane root(const Lane *gap, Lane h, Lane sense) {
    constexpr int PARTS = 8, LAST = N - 1;
    Lane a{}, b = h;
    auto none = sense == 0;
    auto met = none;
#pragma GCC unroll 8
    for (int i = PARTS; i > 0; --i) {  // the first one found is the last one kept
        const Lane high = h * (i * 1.0 / PARTS);
        const auto here = sense * value<LAST>(gap, high) > 0;
        a = choose(here, h * ((i - 1) * 1.0 / PARTS), a);
        b = choose(here, high, b);
        met = met | here;
    }
    if (!any(met)) return h + 1;
    Lane here = 0.5 * (a + b);
    auto busy = met;
    for (int n = 0; n < 60 && any(busy); ++n) {
        Lane g = gap[LAST], d{};
#pragma GCC unroll 32
        for (int k = LAST - 1; k >= 0; --k) { d = d * here + g; g = g * here + gap[k]; }
        const auto past = sense * g > 0;
        b = choose(past, here, b);
        a = choose(past, a, here);
        Lane next = here - g / d;
        next = choose((next > a) & (next < b), next, 0.5 * (a + b));
        busy = busy & (magnitude(next - here) >= 1e-16 * h);
        here = choose(busy, next, here);
    }
    return choose(met, here, h + 1);
}

static double processor_time() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

struct End { double place[3]; int changes; };

// every pad to its end; a lane that is done takes the next one
static long run(const std::vector<double> &given, std::vector<End> &ends) {
    static Motion w;
    static Pads p;
    Lane *parts[6] = {w.x, w.y, w.t, w.u, w.v, w.r};
    const int count = ends.size();
    int next = 0, busy = 0, mine[LANES], changes[LANES];
    long steps = 0;
    Lane left{};
    const auto load = [&](int i) {
        mine[i] = next < count ? next : -1;
        if (mine[i] < 0) { at(left, i) = 0; return; }
        ++next, ++busy;
        changes[i] = 0;
        Lane *to = reinterpret_cast<Lane *>(&p);
        for (int j = 0; j < NUMBERS; ++j) at(to[j], i) = given[mine[i] * NUMBERS + j];
        for (int j = 0; j < 6; ++j) at(parts[j][0], i) = at(p.state[j], i);
        at(left, i) = at(p.stop, i);
    };
    for (int j = 0; j < NUMBERS; ++j) reinterpret_cast<Lane *>(&p)[j] = constant(given[j]);
    for (int j = 0; j < 6; ++j) parts[j][0] = p.state[j];
    for (int i = 0; i < LANES; ++i) load(i);
    while (busy) {
        w.expand(p, std::make_integer_sequence<int, N>());
        Lane h = lesser(w.step(), left), roots[2];
        for (int i = 0; i < 2; ++i) roots[i] = root(w.gap[i], h, 2 * p.on[i] - 1);
        const Lane first = lesser(roots[0], roots[1]);
        const auto met = first <= h;
        h = choose(met, first, h);
        for (Lane *a : parts) a[0] = value<N>(a, h);
        left -= h;
        steps += busy;
        if (any(met | (left <= 0)))
            for (int i = 0; i < LANES; ++i) {
                if (mine[i] < 0) continue;
                if (at(first, i) <= at(h, i)) {
                    const int edge = at(roots[1], i) < at(roots[0], i);
                    at(p.on[edge], i) = 1 - at(p.on[edge], i);
                    ++changes[i];
                }
                if (at(left, i) > 0) continue;
                ends[mine[i]] = {{at(w.x[0], i), at(w.y[0], i), at(w.t[0], i)}, changes[i]};
                --busy;
                load(i);
            }
    }
    return steps;
}

int main() {
    int count, repeats;
    if (std::scanf("%d %d", &count, &repeats) != 2) return 2;
    std::vector<double> given(count * NUMBERS), spent;
    for (double &v : given)
        if (std::scanf("%lf", &v) != 1) return 2;
    std::vector<End> ends(count);
    long steps = 0;
    for (int n = 0; n < repeats; ++n) {
        const double begun = processor_time();
        steps = run(given, ends);
        spent.push_back(processor_time() - begun);
    }
    std::nth_element(spent.begin(), spent.begin() + repeats / 2, spent.end());
    std::printf("%.9e %ld\n", spent[repeats / 2], steps);
    for (const End &e : ends)
        std::printf("%d %.17g %.17g %.17g\n", e.changes, e.place[0], e.place[1], e.place[2]);
}
