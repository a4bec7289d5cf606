# weierstrass: Equation of the Weierstrass p-function
#   x' = y
#   y' = 6*x^2 - 2
# eps is half the time step: the time step is 2 eps.
# Parameters: g2 = 4
# Convention of the source: the source's h is 2 eps
# Source: E. Celledoni, R. I. McLachlan, B. Owren, G. R. W. Quispel. Geometric properties of Kahan's
#   method. J. Phys. A 46 (2013), 025201. arXiv:1209.1164
# Written by kahanmaps VERSION
# For example: kahan_map([1, 2], 1//10)

using LinearAlgebra

# Integers and fractions become fractions of BigInt, so that nothing overflows; floats stay what they are.
exact(value) = value isa Union{Integer, Rational} ? Rational{BigInt}(value) : value

# x' = f(x)
function vector_field(point)
    x = exact(point[1]); y = exact(point[2])
    return [y, 6*x^2 - 2]
end

# M = I - eps f'(x)
function kahan_matrix(point, eps)
    x = exact(point[1]); y = exact(point[2])
    eps = exact(eps)
    return hcat([1, -12*x*eps], [-eps, 1])
end

# r = M x + 2 eps f(x)
function kahan_vector(point, eps)
    x = exact(point[1]); y = exact(point[2])
    eps = exact(eps)
    return [y*eps + x, y - 4*eps]
end

# The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
function kahan_map(point, eps)
    return exact.(kahan_matrix(point, eps)) \ exact.(kahan_vector(point, eps))
end

# Its inverse, which is the map with -eps
function kahan_inverse(point, eps)
    return kahan_map(point, -eps)
end

# Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
function kahan_jacobian(point, eps)
    return exact.(kahan_matrix(point, eps)) \ exact.(kahan_matrix(kahan_map(point, eps), -eps))
end

# The Kahan map as rational functions of x and eps
function kahan_map_formula(point, eps)
    x = exact(point[1]); y = exact(point[2])
    eps = exact(eps)
    return [(-2*y*eps + 4*eps^2 - x)/(12*x*eps^2 - 1),
        (-12*x*y*eps^2 - 12*x^2*eps - y + 4*eps)/(12*x*eps^2 - 1)]
end

# modified_H: the file says that it is an integral of the map
function integral_modified_H(point, eps)
    x = exact(point[1]); y = exact(point[2])
    eps = exact(eps)
    return (-2*x*y^2*eps^2 + 8*x^2*eps^2 + 2*x^3 - 1//2*y^2 + 8//3*eps^2 - 2*x)/(12*x*eps^2 - 1)
end

# H + grad H . (x~ - x)/3, where f = J grad H
function modified_hamiltonian_of(point, image, eps)
    x = exact(point[1]); y = exact(point[2])
    x_new = exact(image[1]); y_new = exact(image[2])
    eps = exact(eps)
    return -2*x^2*x_new + 1//6*y^2 + 1//3*y*y_new + 4//3*x + 2//3*x_new
end

# An integral of the map, by a theorem
function modified_hamiltonian(point, eps)
    return modified_hamiltonian_of(point, kahan_map(point, eps), eps)
end

# phi; the file says that dx/phi is invariant under the map
function density(point, eps)
    x = exact(point[1]); y = exact(point[2])
    eps = exact(eps)
    return -12*x*eps^2 + 1
end
