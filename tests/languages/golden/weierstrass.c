// weierstrass: Equation of the Weierstrass p-function
//   x' = y
//   y' = 6*x^2 - 2
// eps is half the time step: the time step is 2 eps.
// Parameters: g2 = 4
// Convention of the source: the source's h is 2 eps
// Source: E. Celledoni, R. I. McLachlan, B. Owren, G. R. W. Quispel. Geometric properties of Kahan's
//   method. J. Phys. A 46 (2013), 025201. arXiv:1209.1164
// Written by kahanmaps VERSION
// For example: kahan_map((vector){{1, 2}}, 0.1)

#include <math.h>

typedef struct { double at[2]; } vector;
typedef struct { double at[2][2]; } matrix;

// Gauss's elimination: the columns of b become the solutions of M x = b, no numbers where det M = 0. Gives det M.
static double kahan_solve(matrix M, int columns, double *b) {
    double det = 1, entry;
    for (int k = 0; k < 2; k++) {
        int pivot = k;
        for (int i = k + 1; i < 2; i++)
            if (fabs(M.at[i][k]) > fabs(M.at[pivot][k])) pivot = i;
        if (pivot != k) {
            det = -det;
            for (int j = 0; j < 2; j++) entry = M.at[k][j], M.at[k][j] = M.at[pivot][j], M.at[pivot][j] = entry;
            for (int j = 0; j < columns; j++)
                entry = b[k*columns + j], b[k*columns + j] = b[pivot*columns + j], b[pivot*columns + j] = entry;
        }
        det *= M.at[k][k];
        for (int i = 0; i < 2; i++) {
            if (i == k) continue;
            double factor = M.at[i][k]/M.at[k][k];
            for (int j = k; j < 2; j++) M.at[i][j] -= factor*M.at[k][j];
            for (int j = 0; j < columns; j++) b[i*columns + j] -= factor*b[k*columns + j];
        }
    }
    for (int i = 0; i < 2*columns; i++) b[i] /= M.at[i/columns][i/columns];
    return det;
}

static inline vector kahan_solve_vector(matrix M, vector b) {
    kahan_solve(M, 1, b.at);
    return b;
}

static inline matrix kahan_solve_matrix(matrix M, matrix b) {
    kahan_solve(M, 2, b.at[0]);
    return b;
}

// x' = f(x)
vector vector_field(vector point) {
    const double x = point.at[0], y = point.at[1];
    return (vector){{y, 6.0*x*x - 2.0}};
}

// M = I - eps f'(x)
matrix kahan_matrix(vector point, double eps) {
    const double x = point.at[0], y = point.at[1];
    return (matrix){{{1.0, -eps}, {-12.0*x*eps, 1.0}}};
}

// r = M x + 2 eps f(x)
vector kahan_vector(vector point, double eps) {
    const double x = point.at[0], y = point.at[1];
    return (vector){{y*eps + x, y - 4.0*eps}};
}

// The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
vector kahan_map(vector point, double eps) {
    return kahan_solve_vector(kahan_matrix(point, eps), kahan_vector(point, eps));
}

// Its inverse, which is the map with -eps
vector kahan_inverse(vector point, double eps) {
    return kahan_map(point, -eps);
}

// Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
matrix kahan_jacobian(vector point, double eps) {
    return kahan_solve_matrix(kahan_matrix(point, eps), kahan_matrix(kahan_map(point, eps), -eps));
}

// The Kahan map as rational functions of x and eps
vector kahan_map_formula(vector point, double eps) {
    const double x = point.at[0], y = point.at[1];
    return (vector){{(-2.0*y*eps + 4.0*eps*eps - x)/(12.0*x*eps*eps - 1.0),
        (-12.0*x*y*eps*eps - 12.0*x*x*eps - y + 4.0*eps)/(12.0*x*eps*eps - 1.0)}};
}

// modified_H: the file says that it is an integral of the map
double integral_modified_H(vector point, double eps) {
    const double x = point.at[0], y = point.at[1];
    return ((-2.0*x*y*y*eps*eps + 8.0*x*x*eps*eps + 2.0*x*x*x - 1.0/2.0*y*y + 8.0/3.0*eps*eps -
        2.0*x)/(12.0*x*eps*eps - 1.0));
}

// H + grad H . (x~ - x)/3, where f = J grad H
double modified_hamiltonian_of(vector point, vector image, double eps) {
    const double x = point.at[0], y = point.at[1];
    const double x_new = image.at[0], y_new = image.at[1];
    return -2.0*x*x*x_new + 1.0/6.0*y*y + 1.0/3.0*y*y_new + 4.0/3.0*x + 2.0/3.0*x_new;
}

// An integral of the map, by a theorem
double modified_hamiltonian(vector point, double eps) {
    return modified_hamiltonian_of(point, kahan_map(point, eps), eps);
}

// phi; the file says that dx/phi is invariant under the map
double density(vector point, double eps) {
    const double x = point.at[0], y = point.at[1];
    return -12.0*x*eps*eps + 1.0;
}
