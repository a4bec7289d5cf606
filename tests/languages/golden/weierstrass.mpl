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

# x' = f(x)
vector_field := proc(point)
  local x, y;
  x, y := op(convert(point, list));
  Vector([y, 6*x^2 - 2]);
end proc:

# f'(x), the matrix of the derivatives
vector_field_jacobian := proc(point)
  local x, y;
  x, y := op(convert(point, list));
  Matrix([[0, 1],
   [12*x, 0]]);
end proc:

# The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x)
kahan_map := proc(point, eps)
  local M;
  M := LinearAlgebra:-IdentityMatrix(2)
    - LinearAlgebra:-ScalarMultiply(vector_field_jacobian(point), eps);
  if LinearAlgebra:-Determinant(M) = 0 then error "det(I - eps f'(x)) = 0: the Kahan map has no value here" end if;
  Vector(convert(point, list))
    + LinearAlgebra:-ScalarMultiply(LinearAlgebra:-LinearSolve(M, vector_field(point)), 2*eps);
end proc:

# Its inverse, which is the map with -eps
kahan_inverse := proc(point, eps)
  kahan_map(point, -eps);
end proc:

# Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
kahan_jacobian := proc(point, eps)
  local M, image;
  image := kahan_map(point, eps);
  M := LinearAlgebra:-IdentityMatrix(2)
    - LinearAlgebra:-ScalarMultiply(vector_field_jacobian(point), eps);
  LinearAlgebra:-LinearSolve(M,
    LinearAlgebra:-IdentityMatrix(2)
    + LinearAlgebra:-ScalarMultiply(vector_field_jacobian(image), eps));
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

# H, with f = J grad H
hamiltonian := proc(point)
  local x, y;
  x, y := op(convert(point, list));
  -2*x^3 + 1/2*y^2 + 2*x;
end proc:

# grad H
hamiltonian_gradient := proc(point)
  local x, y;
  x, y := op(convert(point, list));
  Vector([-6*x^2 + 2, y]);
end proc:

# An integral of the map, by a theorem: H + grad H . (x~ - x)/3
modified_hamiltonian := proc(point, eps)
  local image;
  image := kahan_map(point, eps);
  hamiltonian(point) + (LinearAlgebra:-Transpose(hamiltonian_gradient(point))
    . (image - Vector(convert(point, list))))/3;
end proc:

# phi; the file says that dx/phi is invariant under the map
density := proc(point, eps)
  local x, y;
  x, y := op(convert(point, list));
  -12*x*eps^2 + 1;
end proc:
