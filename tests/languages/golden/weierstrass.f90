! weierstrass: Equation of the Weierstrass p-function
!   x' = y
!   y' = 6*x^2 - 2
! eps is half the time step: the time step is 2 eps.
! Parameters: g2 = 4
! Convention of the source: the source's h is 2 eps
! Source: E. Celledoni, R. I. McLachlan, B. Owren, G. R. W. Quispel. Geometric properties of Kahan's
!   method. J. Phys. A 46 (2013), 025201. arXiv:1209.1164
! Written by kahanmaps VERSION
! For example: kahan_map([double precision :: 1, 2], 0.1d0)

module kahan_module
implicit none
contains

! Gauss's elimination: M = (A | b) becomes (I | x) with A x = b, no numbers where det A = 0.
subroutine kahan_solve_by_elimination(M, det)
  double precision, intent(inout) :: M(:, :)
  double precision, intent(out) :: det
  double precision :: row(size(M, 2))
  integer :: i, k, pivot
  det = 1
  do k = 1, size(M, 1)
    pivot = k - 1 + maxloc(abs(M(k:, k)), 1)
    if (pivot /= k) det = -det
    row = M(pivot, :)
    det = det*row(k)
    M(pivot, :) = M(k, :)
    M(k, :) = row/row(k)
    do i = 1, size(M, 1)
      if (i /= k) M(i, :) = M(i, :) - M(i, k)*M(k, :)
    end do
  end do
end subroutine kahan_solve_by_elimination

function kahan_solve(A, b) result(value)
  double precision, intent(in) :: A(:, :), b(:, :)
  double precision :: value(size(b, 1), size(b, 2)), M(size(b, 1), size(b, 1) + size(b, 2)), det
  M(:, :size(b, 1)) = A
  M(:, size(b, 1) + 1:) = b
  call kahan_solve_by_elimination(M, det)
  value = M(:, size(b, 1) + 1:)
end function kahan_solve

function kahan_solve_determinant(A) result(value)
  double precision, intent(in) :: A(:, :)
  double precision :: value, M(size(A, 1), size(A, 1))
  M = A
  call kahan_solve_by_elimination(M, value)
end function kahan_solve_determinant

! x' = f(x)
function vector_field(point) result(value)
  double precision, intent(in) :: point(2)
  double precision :: value(2), x, y
  x = point(1); y = point(2)
  value = [y, 6.0d0*x**2 - 2.0d0]
end function vector_field

! M = I - eps f'(x)
function kahan_matrix(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value(2, 2), x, y
  x = point(1); y = point(2)
  value = reshape([1.0d0, -12.0d0*x*eps, -eps, 1.0d0], [2, 2])
end function kahan_matrix

! r = M x + 2 eps f(x)
function kahan_vector(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value(2), x, y
  x = point(1); y = point(2)
  value = [y*eps + x, y - 4.0d0*eps]
end function kahan_vector

! The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
function kahan_map(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value(2)
  value = reshape(kahan_solve(kahan_matrix(point, eps), reshape(kahan_vector(point, eps), [2, 1])), [2])
end function kahan_map

! Its inverse, which is the map with -eps
function kahan_inverse(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value(2)
  value = kahan_map(point, -eps)
end function kahan_inverse

! Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~))
function kahan_jacobian(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value(2, 2)
  value = kahan_solve(kahan_matrix(point, eps), kahan_matrix(kahan_map(point, eps), -eps))
end function kahan_jacobian

! The Kahan map as rational functions of x and eps
function kahan_map_formula(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value(2), x, y
  x = point(1); y = point(2)
  value = [(-2.0d0*y*eps + 4.0d0*eps**2 - x)/(12.0d0*x*eps**2 - 1.0d0), (-12.0d0*x*y*eps**2 - 12.0d0*x**2*eps &
        - y + 4.0d0*eps)/(12.0d0*x*eps**2 - 1.0d0)]
end function kahan_map_formula

! modified_H: the file says that it is an integral of the map
function integral_modified_H(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value, x, y
  x = point(1); y = point(2)
  value = ((-2.0d0*x*y**2*eps**2 + 8.0d0*x**2*eps**2 + 2.0d0*x**3 - 1.0d0/2.0d0*y**2 + 8.0d0/3.0d0*eps**2 - &
        2.0d0*x)/(12.0d0*x*eps**2 - 1.0d0))
end function integral_modified_H

! H + grad H . (x~ - x)/3, where f = J grad H
function modified_hamiltonian_of(point, image, eps) result(value)
  double precision, intent(in) :: point(2), image(2), eps
  double precision :: value, x, y, x_new, y_new
  x = point(1); y = point(2)
  x_new = image(1); y_new = image(2)
  value = -2.0d0*x**2*x_new + 1.0d0/6.0d0*y**2 + 1.0d0/3.0d0*y*y_new + 4.0d0/3.0d0*x + 2.0d0/3.0d0*x_new
end function modified_hamiltonian_of

! An integral of the map, by a theorem
function modified_hamiltonian(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value
  value = modified_hamiltonian_of(point, kahan_map(point, eps), eps)
end function modified_hamiltonian

! phi; the file says that dx/phi is invariant under the map
function density(point, eps) result(value)
  double precision, intent(in) :: point(2), eps
  double precision :: value, x, y
  x = point(1); y = point(2)
  value = -12.0d0*x*eps**2 + 1.0d0
end function density

end module kahan_module
