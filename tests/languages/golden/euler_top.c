// euler_top: Euler top
//   x1' = x2*x3*a1
//   x2' = x1*x3*a2
//   x3' = x1*x2
// eps is half the time step: the time step is 2 eps.
// Parameters: a3 = 1
// Parameters left as symbols: a1, a2
// Convention of the source: the sources' epsilon is eps: x1~ - x1 = eps a1 (x2~ x3 + x2 x3~), and
//   cyclic, so that the time step is 2 eps
// Source: R. Hirota, K. Kimura. Discretization of the Euler top. J. Phys. Soc. Japan 69 (2000),
//   627-630
// Source: M. Petrera, Yu. B. Suris. On the Hamiltonian structure of Hirota-Kimura discretization of
//   the Euler top. Math. Nachr. 283 (2010), 1654-1663. arXiv:0707.4382
// Source: M. Petrera, A. Pfadler, Yu. B. Suris. On integrability of Hirota-Kimura type
//   discretizations. Regul. Chaotic Dyn. 16 (2011), 245-289. arXiv:1008.1040
// Written by kahanmaps VERSION
// For example: top_kahan_map((top_vector){{1, 2, 3}}, 0.1, a1, a2)

#include <math.h>

typedef struct { double at[3]; } top_vector;
typedef struct { double at[3][3]; } top_matrix;

// Gauss's elimination: the columns of b become the solutions of M x = b, no numbers where det M = 0. Gives det M.
static double top_kahan_solve(top_matrix M, int columns, double *b) {
    double det = 1, entry;
    for (int k = 0; k < 3; k++) {
        int pivot = k;
        for (int i = k + 1; i < 3; i++)
            if (fabs(M.at[i][k]) > fabs(M.at[pivot][k])) pivot = i;
        if (pivot != k) {
            det = -det;
            for (int j = 0; j < 3; j++) entry = M.at[k][j], M.at[k][j] = M.at[pivot][j], M.at[pivot][j] = entry;
            for (int j = 0; j < columns; j++)
                entry = b[k*columns + j], b[k*columns + j] = b[pivot*columns + j], b[pivot*columns + j] = entry;
        }
        det *= M.at[k][k];
        for (int i = 0; i < 3; i++) {
            if (i == k) continue;
            double factor = M.at[i][k]/M.at[k][k];
            for (int j = k; j < 3; j++) M.at[i][j] -= factor*M.at[k][j];
            for (int j = 0; j < columns; j++) b[i*columns + j] -= factor*b[k*columns + j];
        }
    }
    for (int i = 0; i < 3*columns; i++) b[i] /= M.at[i/columns][i/columns];
    return det;
}

static inline top_vector top_kahan_solve_vector(top_matrix M, top_vector b) {
    top_kahan_solve(M, 1, b.at);
    return b;
}

static inline top_matrix top_kahan_solve_matrix(top_matrix M, top_matrix b) {
    top_kahan_solve(M, 3, b.at[0]);
    return b;
}

// x' = f(x)
top_vector top_vector_field(top_vector point, double a1, double a2) {
    const double x1 = point.at[0], x2 = point.at[1], x3 = point.at[2];
    return (top_vector){{x2*x3*a1, x1*x3*a2, x1*x2}};
}

// M = I - eps f'(x)
top_matrix top_kahan_matrix(top_vector point, double eps, double a1, double a2) {
    const double x1 = point.at[0], x2 = point.at[1], x3 = point.at[2];
    return (top_matrix){{{1.0, -x3*a1*eps, -x2*a1*eps}, {-x3*a2*eps, 1.0, -x1*a2*eps}, {-x2*eps, -x1*eps, 1.0}}};
}

// r = M x + 2 eps f(x)
top_vector top_kahan_vector(top_vector point, double eps, double a1, double a2) {
    const double x1 = point.at[0], x2 = point.at[1], x3 = point.at[2];
    return (top_vector){{x1, x2, x3}};
}

// The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
top_vector top_kahan_map(top_vector point, double eps, double a1, double a2) {
    return top_kahan_solve_vector(top_kahan_matrix(point, eps, a1, a2), top_kahan_vector(point, eps, a1, a2));
}

// F1: the file says that it is an integral of the map
double top_integral_F1(top_vector point, double eps, double a1, double a2) {
    const double x1 = point.at[0], x2 = point.at[1], x3 = point.at[2];
    return (x2*x2*a1*eps*eps - 1.0)/(x3*x3*a1*a2*eps*eps - 1.0);
}

// F2: the file says that it is an integral of the map
double top_integral_F2(top_vector point, double eps, double a1, double a2) {
    const double x1 = point.at[0], x2 = point.at[1], x3 = point.at[2];
    return (x3*x3*a1*a2*eps*eps - 1.0)/(x1*x1*a2*eps*eps - 1.0);
}

// phi; the file says that dx/phi is invariant under the map
double top_density(top_vector point, double eps, double a1, double a2) {
    const double x1 = point.at[0], x2 = point.at[1], x3 = point.at[2];
    return x3*x3*x3*x3*a1*a1*a2*a2*eps*eps*eps*eps - 2.0*x3*x3*a1*a2*eps*eps + 1.0;
}
