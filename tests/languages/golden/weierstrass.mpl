# weierstrass: Equation of the Weierstrass p-function
#   x' = y
#   y' = 6*x^2 - 2
# eps is half the time step: the time step is 2 eps.
# Parameters: g2 = 4
# Convention of the source: the source's h is 2 eps
# Source: E. Celledoni, R. I. McLachlan, B. Owren, G. R. W. Quispel. Geometric properties of Kahan's
#   method. J. Phys. A 46 (2013), 025201. arXiv:1209.1164
# Written by kahanmaps VERSION
# For example: kahan_map([1, 2], 1/10);

kahan_solve := proc(M, b)
  if LinearAlgebra:-Determinant(M) = 0 then error "det M = 0: the map has no value here" end if;
  LinearAlgebra:-LinearSolve(M, b);
end proc:

# x' = f(x)
vector_field := proc(point)
  local x, y;
  x, y := op(convert(point, list));
  Vector([y, 6*x^2 - 2]);
end proc:

# M = I - eps f'(x)
kahan_matrix := proc(point, eps)
  local x, y;
  x, y := op(convert(point, list));
  Matrix([[1, -eps], [-12*x*eps, 1]]);
end proc:

# r = M x + 2 eps f(x)
kahan_vector := proc(point, eps)
  local x, y;
  x, y := op(convert(point, list));
  Vector([y*eps + x, y - 4*eps]);
end proc:

# The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
kahan_map := proc(point, eps)
  kahan_solve(kahan_matrix(point, eps), kahan_vector(point, eps));
end proc:

# Its inverse, which is the map with -eps
kahan_inverse := proc(point, eps)
  kahan_map(point, -eps);
end proc:

# Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
kahan_jacobian := proc(point, eps)
  kahan_solve(kahan_matrix(point, eps), kahan_matrix(kahan_map(point, eps), -eps));
end proc:

# The Kahan map as rational functions of x and eps
kahan_map_formula := proc(point, eps)
  local x, y;
  x, y := op(convert(point, list));
  Vector([(-2*y*eps + 4*eps^2 - x)/(12*x*eps^2 - 1),
        (-12*x*y*eps^2 - 12*x^2*eps - y + 4*eps)/(12*x*eps^2 - 1)]);
end proc:

# modified_H: the file says that it is an integral of the map
integral_modified_H := proc(point, eps)
  local x, y;
  x, y := op(convert(point, list));
  (-2*x*y^2*eps^2 + 8*x^2*eps^2 + 2*x^3 - 1/2*y^2 + 8/3*eps^2 - 2*x)/(12*x*eps^2 - 1);
end proc:

# H + grad H . (x~ - x)/3, where f = J grad H
modified_hamiltonian_of := proc(point, image, eps)
  local x, y, x_new, y_new;
  x, y := op(convert(point, list));
  x_new, y_new := op(convert(image, list));
  -2*x^2*x_new + 1/6*y^2 + 1/3*y*y_new + 4/3*x + 2/3*x_new;
end proc:

# An integral of the map, by a theorem
modified_hamiltonian := proc(point, eps)
  modified_hamiltonian_of(point, kahan_map(point, eps), eps);
end proc:

# phi; the file says that dx/phi is invariant under the map
density := proc(point, eps)
  local x, y;
  x, y := op(convert(point, list));
  -12*x*eps^2 + 1;
end proc:
