# euler_top: Euler top
#   x1' = x2*x3*a1
#   x2' = x1*x3*a2
#   x3' = x1*x2
# eps is half the time step: the time step is 2 eps.
# Parameters: a3 = 1
# Parameters left as symbols: a1, a2
# Convention of the source: the sources' epsilon is eps: x1~ - x1 = eps a1 (x2~ x3 + x2 x3~), and
#   cyclic, so that the time step is 2 eps
# Source: R. Hirota, K. Kimura. Discretization of the Euler top. J. Phys. Soc. Japan 69 (2000),
#   627-630
# Source: M. Petrera, Yu. B. Suris. On the Hamiltonian structure of Hirota-Kimura discretization of
#   the Euler top. Math. Nachr. 283 (2010), 1654-1663. arXiv:0707.4382
# Source: M. Petrera, A. Pfadler, Yu. B. Suris. On integrability of Hirota-Kimura type
#   discretizations. Regul. Chaotic Dyn. 16 (2011), 245-289. arXiv:1008.1040
# Written by kahanmaps VERSION
# For example: top_kahan_map([1, 2, 3], 1/10, a1, a2);

top_kahan_solve := proc(M, b)
  if LinearAlgebra:-Determinant(M) = 0 then error "det M = 0: the map has no value here" end if;
  LinearAlgebra:-LinearSolve(M, b);
end proc:

# x' = f(x)
top_vector_field := proc(point, a1, a2)
  local x1, x2, x3;
  x1, x2, x3 := op(convert(point, list));
  Vector([x2*x3*a1, x1*x3*a2, x1*x2]);
end proc:

# M = I - eps f'(x)
top_kahan_matrix := proc(point, eps, a1, a2)
  local x1, x2, x3;
  x1, x2, x3 := op(convert(point, list));
  Matrix([[1, -x3*a1*eps, -x2*a1*eps], [-x3*a2*eps, 1, -x1*a2*eps], [-x2*eps, -x1*eps, 1]]);
end proc:

# r = M x + 2 eps f(x)
top_kahan_vector := proc(point, eps, a1, a2)
  local x1, x2, x3;
  x1, x2, x3 := op(convert(point, list));
  Vector([x1, x2, x3]);
end proc:

# The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
top_kahan_map := proc(point, eps, a1, a2)
  top_kahan_solve(top_kahan_matrix(point, eps, a1, a2), top_kahan_vector(point, eps, a1, a2));
end proc:

# F1: the file says that it is an integral of the map
top_integral_F1 := proc(point, eps, a1, a2)
  local x1, x2, x3;
  x1, x2, x3 := op(convert(point, list));
  (x2^2*a1*eps^2 - 1)/(x3^2*a1*a2*eps^2 - 1);
end proc:

# F2: the file says that it is an integral of the map
top_integral_F2 := proc(point, eps, a1, a2)
  local x1, x2, x3;
  x1, x2, x3 := op(convert(point, list));
  (x3^2*a1*a2*eps^2 - 1)/(x1^2*a2*eps^2 - 1);
end proc:

# phi; the file says that dx/phi is invariant under the map
top_density := proc(point, eps, a1, a2)
  local x1, x2, x3;
  x1, x2, x3 := op(convert(point, list));
  x3^4*a1^2*a2^2*eps^4 - 2*x3^2*a1*a2*eps^2 + 1;
end proc:
