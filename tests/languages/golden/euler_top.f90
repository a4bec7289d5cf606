! euler_top: Euler top
!   x1' = x2*x3*a1
!   x2' = x1*x3*a2
!   x3' = x1*x2
! eps is half the time step: the time step is 2 eps.
! Parameters: a3 = 1
! Parameters left as symbols: a1, a2
! Convention of the source: the sources' epsilon is eps: x1~ - x1 = eps a1 (x2~ x3 + x2 x3~), and
!   cyclic, so that the time step is 2 eps
! Source: R. Hirota, K. Kimura. Discretization of the Euler top. J. Phys. Soc. Japan 69 (2000),
!   627-630
! Source: M. Petrera, Yu. B. Suris. On the Hamiltonian structure of Hirota-Kimura discretization of
!   the Euler top. Math. Nachr. 283 (2010), 1654-1663. arXiv:0707.4382
! Source: M. Petrera, A. Pfadler, Yu. B. Suris. On integrability of Hirota-Kimura type
!   discretizations. Regul. Chaotic Dyn. 16 (2011), 245-289. arXiv:1008.1040
! Written by kahanmaps VERSION
! For example: top_kahan_map([double precision :: 1, 2, 3], 0.1d0, a1, a2)

module top_kahan_module
implicit none
contains

! Gauss's elimination: M = (A | b) becomes (I | x) with A x = b, no numbers where det A = 0.
subroutine top_kahan_solve_by_elimination(M, det)
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
end subroutine top_kahan_solve_by_elimination

function top_kahan_solve(A, b) result(value)
  double precision, intent(in) :: A(:, :), b(:, :)
  double precision :: value(size(b, 1), size(b, 2)), M(size(b, 1), size(b, 1) + size(b, 2)), det
  M(:, :size(b, 1)) = A
  M(:, size(b, 1) + 1:) = b
  call top_kahan_solve_by_elimination(M, det)
  value = M(:, size(b, 1) + 1:)
end function top_kahan_solve

function top_kahan_solve_determinant(A) result(value)
  double precision, intent(in) :: A(:, :)
  double precision :: value, M(size(A, 1), size(A, 1))
  M = A
  call top_kahan_solve_by_elimination(M, value)
end function top_kahan_solve_determinant

! x' = f(x)
function top_vector_field(point, a1, a2) result(value)
  double precision, intent(in) :: point(3), a1, a2
  double precision :: value(3), x1, x2, x3
  x1 = point(1); x2 = point(2); x3 = point(3)
  value = [x2*x3*a1, x1*x3*a2, x1*x2]
end function top_vector_field

! M = I - eps f'(x)
function top_kahan_matrix(point, eps, a1, a2) result(value)
  double precision, intent(in) :: point(3), eps, a1, a2
  double precision :: value(3, 3), x1, x2, x3
  x1 = point(1); x2 = point(2); x3 = point(3)
  value = reshape([1.0d0, -x3*a2*eps, -x2*eps, -x3*a1*eps, 1.0d0, -x1*eps, -x2*a1*eps, -x1*a2*eps, 1.0d0], [3, &
        3])
end function top_kahan_matrix

! r = M x + 2 eps f(x)
function top_kahan_vector(point, eps, a1, a2) result(value)
  double precision, intent(in) :: point(3), eps, a1, a2
  double precision :: value(3), x1, x2, x3
  x1 = point(1); x2 = point(2); x3 = point(3)
  value = [x1, x2, x3]
end function top_kahan_vector

! The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r
function top_kahan_map(point, eps, a1, a2) result(value)
  double precision, intent(in) :: point(3), eps, a1, a2
  double precision :: value(3)
  value = reshape(top_kahan_solve(top_kahan_matrix(point, eps, a1, a2), reshape(top_kahan_vector(point, eps, &
        a1, a2), [3, 1])), [3])
end function top_kahan_map

! F1: the file says that it is an integral of the map
function top_integral_F1(point, eps, a1, a2) result(value)
  double precision, intent(in) :: point(3), eps, a1, a2
  double precision :: value, x1, x2, x3
  x1 = point(1); x2 = point(2); x3 = point(3)
  value = (x2**2*a1*eps**2 - 1.0d0)/(x3**2*a1*a2*eps**2 - 1.0d0)
end function top_integral_F1

! F2: the file says that it is an integral of the map
function top_integral_F2(point, eps, a1, a2) result(value)
  double precision, intent(in) :: point(3), eps, a1, a2
  double precision :: value, x1, x2, x3
  x1 = point(1); x2 = point(2); x3 = point(3)
  value = (x3**2*a1*a2*eps**2 - 1.0d0)/(x1**2*a2*eps**2 - 1.0d0)
end function top_integral_F2

! phi; the file says that dx/phi is invariant under the map
function top_density(point, eps, a1, a2) result(value)
  double precision, intent(in) :: point(3), eps, a1, a2
  double precision :: value, x1, x2, x3
  x1 = point(1); x2 = point(2); x3 = point(3)
  value = x3**4*a1**2*a2**2*eps**4 - 2.0d0*x3**2*a1*a2*eps**2 + 1.0d0
end function top_density

end module top_kahan_module
