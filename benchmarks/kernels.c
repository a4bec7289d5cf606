/* The limits of bench_float.py: what a C compiler makes of the same steps, without any test for what may go wrong.
 *
 * gcc -O3 -march=native, contraction of a*b + c allowed as is gcc's default. State of n lanes: array (rows, n).
 * planar_*: any binary cubic, coefficients a, b, c, d a block (A = a U + b V, B = b U + c V, C = c U + d V).
 * cubes_*, lines_*: the two canonical cubics, which have no coefficients.
 */

#include <stddef.h>

#define W 256   /* lanes taken together */

void planar_many(double *z, size_t m, size_t n, const double *k, size_t steps)
{
    for (size_t at = 0; at < n; at += W) {
        size_t width = n - at < W ? n - at : W;
        for (size_t r = 0; r < m; r++) {
            double *restrict u = z + 2 * r * n + at, *restrict v = u + n;
            double a = k[4 * r], b = k[4 * r + 1], c = k[4 * r + 2], d = k[4 * r + 3];
            /* 1 + eps^2 D expanded: fewer operations than A C - B^2 once they can be contracted */
            double p = a * c - b * b, q = a * d - b * c, s = b * d - c * c, b2 = 2 * b, c2 = 2 * c;
            for (size_t t = 0; t < steps; t++)
                for (size_t i = 0; i < width; i++) {
                    double U = u[i], V = v[i], x = U * U, y = U * V, o = V * V;
                    double w = 1 / (1 + p * x + q * y + s * o);
                    u[i] = (U + b * x + c2 * y + d * o) * w;
                    v[i] = (V - a * x - b2 * y - c * o) * w;
                }
        }
    }
}

/* kind 0: U V (U + V), kind 1: (U^3 + V^3)/3 */
void canonical_many(double *z, size_t m, size_t n, const long *kind, size_t steps)
{
    for (size_t at = 0; at < n; at += W) {
        size_t width = n - at < W ? n - at : W;
        for (size_t r = 0; r < m; r++) {
            double *restrict u = z + 2 * r * n + at, *restrict v = u + n;
            if (kind[r])
                for (size_t t = 0; t < steps; t++)
                    for (size_t i = 0; i < width; i++) {
                        double U = u[i], V = v[i], w = 1 / (1 + U * V);
                        u[i] = (U + V * V) * w;
                        v[i] = (V - U * U) * w;
                    }
            else
                for (size_t t = 0; t < steps; t++)
                    for (size_t i = 0; i < width; i++) {
                        double U = u[i], V = v[i], B = U + V, g = U * V, p = 1 + B, q = 1 - B, w = 1 / (p * q + g);
                        u[i] = (p * U + g) * w;
                        v[i] = (q * V - g) * w;
                    }
        }
    }
}

#define PLANAR(U, V, k) { \
    double A = k[0] * U + k[1] * V, B = k[1] * U + k[2] * V, C = k[2] * U + k[3] * V, p = 1 + B, q = 1 - B; \
    double w = 1 / (p * q + A * C), T = (p * U + C * V) * w; \
    V = (q * V - A * U) * w; \
    U = T; }

#define EXPANDED(U, V, k) { \
    double x = U * U, y = U * V, o = V * V; \
    double w = 1 / (1 + k[4] * x + k[5] * y + k[6] * o), T = (U + k[1] * x + k[7] * y + k[3] * o) * w; \
    V = (V - k[0] * x - k[8] * y - k[2] * o) * w; \
    U = T; }

/* one orbit with three blocks, all in registers */
void planar_one(double *z, const double *k, size_t steps)
{
    double U0 = z[0], V0 = z[1], U1 = z[2], V1 = z[3], U2 = z[4], V2 = z[5];
    const double *k1 = k + 4, *k2 = k + 8;
    for (size_t t = 0; t < steps; t++) {
        PLANAR(U0, V0, k) PLANAR(U1, V1, k1) PLANAR(U2, V2, k2)
    }
    z[0] = U0; z[1] = V0; z[2] = U1; z[3] = V1; z[4] = U2; z[5] = V2;
}

void expanded_one(double *z, const double *k, size_t steps)
{
    double U0 = z[0], V0 = z[1], U1 = z[2], V1 = z[3], U2 = z[4], V2 = z[5], e[27];
    for (int r = 0; r < 3; r++) {
        double a = k[4 * r], b = k[4 * r + 1], c = k[4 * r + 2], d = k[4 * r + 3], *f = e + 9 * r;
        f[0] = a; f[1] = b; f[2] = c; f[3] = d;
        f[4] = a * c - b * b; f[5] = a * d - b * c; f[6] = b * d - c * c; f[7] = 2 * c; f[8] = 2 * b;
    }
    const double *e0 = e, *e1 = e + 9, *e2 = e + 18;
    for (size_t t = 0; t < steps; t++) {
        EXPANDED(U0, V0, e0) EXPANDED(U1, V1, e1) EXPANDED(U2, V2, e2)
    }
    z[0] = U0; z[1] = V0; z[2] = U1; z[3] = V1; z[4] = U2; z[5] = V2;
}

/* generic elimination in dimension 6 without pivoting, eight lanes in registers as far as they go; homogeneous */
#define D 6
#define L 8
void generic_many(double *z, size_t n, const double *tensor, size_t steps)
{
    for (size_t at = 0; at + L <= n; at += L) {
        double x[D][L];
        for (int j = 0; j < D; j++)
            for (int l = 0; l < L; l++) x[j][l] = z[j * n + at + l];
        for (size_t t = 0; t < steps; t++) {
            double M[D][D][L], y[D][L];
            for (int i = 0; i < D; i++) {
                for (int j = 0; j < D; j++) {
                    const double *f = tensor + (i * D + j) * D;
                    for (int l = 0; l < L; l++) {
                        double s = i == j;
                        for (int k = 0; k < D; k++) s -= f[k] * x[k][l];
                        M[i][j][l] = s;
                    }
                }
                for (int l = 0; l < L; l++) y[i][l] = x[i][l];
            }
            for (int p = 0; p < D; p++) {
                double inverse[L];
                for (int l = 0; l < L; l++) inverse[l] = 1 / M[p][p][l];
                for (int i = p + 1; i < D; i++) {
                    double f[L];
                    for (int l = 0; l < L; l++) f[l] = M[i][p][l] * inverse[l];
                    for (int j = p + 1; j < D; j++)
                        for (int l = 0; l < L; l++) M[i][j][l] -= f[l] * M[p][j][l];
                    for (int l = 0; l < L; l++) y[i][l] -= f[l] * y[p][l];
                }
            }
            for (int i = D - 1; i >= 0; i--) {
                for (int j = i + 1; j < D; j++)
                    for (int l = 0; l < L; l++) y[i][l] -= M[i][j][l] * x[j][l];
                for (int l = 0; l < L; l++) x[i][l] = y[i][l] / M[i][i][l];
            }
        }
        for (int j = 0; j < D; j++)
            for (int l = 0; l < L; l++) z[j * n + at + l] = x[j][l];
    }
}

/* Euler's top x' = yz, y' = -2zx, z' = xy by Cramer's rule. */
static inline void top(double e, double *px, double *py, double *pz)
{
    double x = *px, y = *py, z = *pz, X = e * x, Y = e * y, Z = e * z;
    /* M = [1 -Z -Y; 2Z 1 2X; -Y -X 1], the columns of its adjugate, and M x~ = x */
    double a = 1 + 2 * X * X, b = -2 * (Z + X * Y), c = Y - 2 * X * Z;
    double w = 1 / (a - Z * b - Y * c);
    *px = (a * x + (Z + X * Y) * y + (Y - 2 * X * Z) * z) * w;
    *py = (b * x + (1 - Y * Y) * y - 2 * (X + Y * Z) * z) * w;
    *pz = (c * x + (X + Y * Z) * y + (1 + 2 * Z * Z) * z) * w;
}

void top_one(double *v, double e, size_t steps)
{
    double x = v[0], y = v[1], z = v[2];
    for (size_t t = 0; t < steps; t++)
        top(e, &x, &y, &z);
    v[0] = x, v[1] = y, v[2] = z;
}

void top_many(double *v, size_t n, double e, size_t steps)
{
    for (size_t at = 0; at < n; at += W) {
        size_t width = n - at < W ? n - at : W;
        double *restrict x = v + at, *restrict y = x + n, *restrict z = y + n;
        for (size_t t = 0; t < steps; t++)
            for (size_t i = 0; i < width; i++)
                top(e, x + i, y + i, z + i);
    }
}
