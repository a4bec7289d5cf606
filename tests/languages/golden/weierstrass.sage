# weierstrass: Equation of the Weierstrass p-function
#   x' = y
#   y' = 6*x^2 - 2
# eps is half the time step: the time step is 2 eps.
# Parameters: g2 = 4
# Convention of the source: the source's h is 2 eps
# Source: E. Celledoni, R. I. McLachlan, B. Owren, G. R. W. Quispel. Geometric properties of Kahan's
#   method. J. Phys. A 46 (2013), 025201. arXiv:1209.1164
# Written by kahanmaps VERSION
# For example: kahan_map([1, 2], 1/10)

def kahan_solve(M, b):
    if M.is_singular():
        raise ZeroDivisionError("det M = 0: the map has no value here")
    return M.solve_right(b)

# x' = f(x)
def vector_field(point):
    [x, y] = vector(point)
    return vector([y, 6*x^2 - 2])

# M = I - eps f'(x)
def kahan_matrix(point, eps):
    [x, y] = vector(point)
    return matrix([[1, -eps], [-12*x*eps, 1]])

# r = M x + 2 eps f(x)
def kahan_vector(point, eps):
    [x, y] = vector(point)
    return vector([y*eps + x, y - 4*eps])

# The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
def kahan_map(point, eps):
    return kahan_solve(kahan_matrix(point, eps), kahan_vector(point, eps))

# Its inverse, which is the map with -eps
def kahan_inverse(point, eps):
    return kahan_map(point, -eps)

# Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
def kahan_jacobian(point, eps):
    return kahan_solve(kahan_matrix(point, eps), kahan_matrix(kahan_map(point, eps), -eps))

# The Kahan map as rational functions of x and eps
def kahan_map_formula(point, eps):
    [x, y] = vector(point)
    return vector([(-2*y*eps + 4*eps^2 - x)/(12*x*eps^2 - 1),
        (-12*x*y*eps^2 - 12*x^2*eps - y + 4*eps)/(12*x*eps^2 - 1)])

# modified_H: the file says that it is an integral of the map
def integral_modified_H(point, eps):
    [x, y] = vector(point)
    return (-2*x*y^2*eps^2 + 8*x^2*eps^2 + 2*x^3 - 1/2*y^2 + 8/3*eps^2 - 2*x)/(12*x*eps^2 - 1)

# H + grad H . (x~ - x)/3, where f = J grad H
def modified_hamiltonian_of(point, image, eps):
    [x, y] = vector(point)
    [x_new, y_new] = vector(image)
    return -2*x^2*x_new + 1/6*y^2 + 1/3*y*y_new + 4/3*x + 2/3*x_new

# An integral of the map, by a theorem
def modified_hamiltonian(point, eps):
    return modified_hamiltonian_of(point, kahan_map(point, eps), eps)

# phi; the file says that dx/phi is invariant under the map
def density(point, eps):
    [x, y] = vector(point)
    return -12*x*eps^2 + 1
