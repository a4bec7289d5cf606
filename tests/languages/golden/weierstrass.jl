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
    x, y = exact.(point)
    return [y, 6*x^2 - 2]
end

# f'(x), the matrix of the derivatives
function vector_field_jacobian(point)
    x, y = exact.(point)
    return hcat([0, 12*x],
        [1, 0])
end

# The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x)
function kahan_map(point, eps)
    eps = exact(eps)
    M = I - eps*vector_field_jacobian(point)
    return collect(exact.(point)) + 2*eps*(M \ vector_field(point))
end

# Its inverse, which is the map with -eps
kahan_inverse(point, eps) = kahan_map(point, -eps)

# Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
function kahan_jacobian(point, eps)
    eps = exact(eps)
    image = kahan_map(point, eps)
    M = I - eps*vector_field_jacobian(point)
    return M \ (I + eps*vector_field_jacobian(image))
end

# The Kahan map as rational functions of x and eps
function kahan_map_formula(point, eps)
    x, y = exact.(point)
    eps = exact(eps)
    return [(-2*y*eps + 4*eps^2 - x)/(12*x*eps^2 - 1),
        (-12*x*y*eps^2 - 12*x^2*eps - y + 4*eps)/(12*x*eps^2 - 1)]
end

# modified_H: the file says that it is an integral of the map
function integral_modified_H(point, eps)
    x, y = exact.(point)
    eps = exact(eps)
    return (-2*x*y^2*eps^2 + 8*x^2*eps^2 + 2*x^3 - 1//2*y^2 + 8//3*eps^2 - 2*x)/(12*x*eps^2 - 1)
end

# H, with f = J grad H
function hamiltonian(point)
    x, y = exact.(point)
    return -2*x^3 + 1//2*y^2 + 2*x
end

# grad H
function hamiltonian_gradient(point)
    x, y = exact.(point)
    return [-6*x^2 + 2, y]
end

# An integral of the map, by a theorem: H + grad H . (x~ - x)/3
function modified_hamiltonian(point, eps)
    step = kahan_map(point, eps) - collect(exact.(point))
    return hamiltonian(point) + sum(hamiltonian_gradient(point) .* step)*1//3
end

# phi; the file says that dx/phi is invariant under the map
function density(point, eps)
    x, y = exact.(point)
    eps = exact(eps)
    return -12*x*eps^2 + 1
end
