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

# x' = f(x)
def vector_field(point):
    x, y = vector(point)
    return vector([y, 6*x^2 - 2])

# f'(x), the matrix of the derivatives
def vector_field_jacobian(point):
    x, y = vector(point)
    return matrix([[0, 1],
        [12*x, 0]])

# The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x)
def kahan_map(point, eps):
    M = identity_matrix(2) - eps*vector_field_jacobian(point)
    if M.is_singular():
        raise ZeroDivisionError("det(I - eps f'(x)) = 0: the Kahan map has no value here")
    return vector(point) + 2*eps*M.solve_right(vector_field(point))

# Its inverse, which is the map with -eps
def kahan_inverse(point, eps):
    return kahan_map(point, -eps)

# Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
def kahan_jacobian(point, eps):
    image = kahan_map(point, eps)
    M = identity_matrix(2) - eps*vector_field_jacobian(point)
    return M.solve_right(identity_matrix(2) + eps*vector_field_jacobian(image))

# The Kahan map as rational functions of x and eps
def kahan_map_formula(point, eps):
    x, y = vector(point)
    return vector([(-2*y*eps + 4*eps^2 - x)/(12*x*eps^2 - 1),
        (-12*x*y*eps^2 - 12*x^2*eps - y + 4*eps)/(12*x*eps^2 - 1)])

# modified_H: the file says that it is an integral of the map
def integral_modified_H(point, eps):
    x, y = vector(point)
    return (-2*x*y^2*eps^2 + 8*x^2*eps^2 + 2*x^3 - 1/2*y^2 + 8/3*eps^2 - 2*x)/(12*x*eps^2 - 1)

# H, with f = J grad H
def hamiltonian(point):
    x, y = vector(point)
    return -2*x^3 + 1/2*y^2 + 2*x

# grad H
def hamiltonian_gradient(point):
    x, y = vector(point)
    return vector([-6*x^2 + 2, y])

# An integral of the map, by a theorem: H + grad H . (x~ - x)/3
def modified_hamiltonian(point, eps):
    step = kahan_map(point, eps) - vector(point)
    return hamiltonian(point) + hamiltonian_gradient(point)*step/3

# phi; the file says that dx/phi is invariant under the map
def density(point, eps):
    x, y = vector(point)
    return -12*x*eps^2 + 1
