(* weierstrass: Equation of the Weierstrass p-function *)
(*   x' = y *)
(*   y' = 6*x^2 - 2 *)
(* eps is half the time step: the time step is 2 eps. *)
(* Parameters: g2 = 4 *)
(* Convention of the source: the source's h is 2 eps *)
(* Source: E. Celledoni, R. I. McLachlan, B. Owren, G. R. W. Quispel. Geometric properties of Kahan's *)
(*   method. J. Phys. A 46 (2013), 025201. arXiv:1209.1164 *)
(* Written by kahanmaps VERSION *)
(* For example: kahanMap[{1, 2}, 1/10] *)

ClearAll[vectorField,
  vectorFieldJacobian,
  kahanMap,
  kahanInverse,
  kahanJacobian,
  kahanMapFormula,
  integralModifiedH,
  hamiltonian,
  hamiltonianGradient,
  modifiedHamiltonian,
  density];

(* x' = f(x) *)
vectorField[{x_, y_}] :=
  {y, 6*x^2 - 2};

(* f'(x), the matrix of the derivatives *)
vectorFieldJacobian[{x_, y_}] :=
  {{0, 1},
   {12*x, 0}};

(* The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x) *)
kahanMap[point_List, eps_] := Module[{m},
  m = IdentityMatrix[2] - eps*vectorFieldJacobian[point];
  If[Det[m] === 0, $Failed, point + 2*eps*LinearSolve[m, vectorField[point]]]
];

(* Its inverse, which is the map with -eps *)
kahanInverse[point_List, eps_] := kahanMap[point, -eps];

(* Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~)) *)
kahanJacobian[point_List, eps_] := Module[{m, image},
  m = IdentityMatrix[2] - eps*vectorFieldJacobian[point];
  image = kahanMap[point, eps];
  If[image === $Failed, $Failed,
    Inverse[m].(IdentityMatrix[2] + eps*vectorFieldJacobian[image])]
];

(* The Kahan map as rational functions of x and eps *)
kahanMapFormula[{x_, y_}, eps_] :=
  {(-2*y*eps + 4*eps^2 - x)/(12*x*eps^2 - 1),
   (-12*x*y*eps^2 - 12*x^2*eps - y + 4*eps)/(12*x*eps^2 - 1)};

(* modified_H: the file says that it is an integral of the map *)
integralModifiedH[{x_, y_}, eps_] :=
  (-2*x*y^2*eps^2 + 8*x^2*eps^2 + 2*x^3 - 1/2*y^2 + 8/3*eps^2 - 2*x)/(12*x*eps^2 - 1);

(* H, with f = J grad H *)
hamiltonian[{x_, y_}] :=
  -2*x^3 + 1/2*y^2 + 2*x;

(* grad H *)
hamiltonianGradient[{x_, y_}] :=
  {-6*x^2 + 2, y};

(* An integral of the map, by a theorem: H + grad H . (x~ - x)/3 *)
modifiedHamiltonian[point_List, eps_] := Module[{image},
  image = kahanMap[point, eps];
  If[image === $Failed, $Failed,
    hamiltonian[point] + hamiltonianGradient[point].(image - point)/3]
];

(* phi; the file says that dx/phi is invariant under the map *)
density[{x_, y_}, eps_] :=
  -12*x*eps^2 + 1;
