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
        kahanMatrix,
        kahanVector,
        kahanMap,
        kahanInverse,
        kahanJacobian,
        kahanMapFormula,
        integralModifiedH,
        modifiedHamiltonianOf,
        modifiedHamiltonian,
        density];

kahanSolve[m_, b_] := If[Det[m] === 0,
  Print["det M = 0: the map has no value here"]; Abort[],
  LinearSolve[m, b]
];

(* x' = f(x) *)
vectorField[point_List] := Module[{x, y},
  {x, y} = point;
  {y, 6*x^2 - 2}
];

(* M = I - eps f'(x) *)
kahanMatrix[point_List, eps_] := Module[{x, y},
  {x, y} = point;
  {{1, -eps}, {-12*x*eps, 1}}
];

(* r = M x + 2 eps f(x) *)
kahanVector[point_List, eps_] := Module[{x, y},
  {x, y} = point;
  {y*eps + x, y - 4*eps}
];

(* The Kahan map: x~ = x + 2 eps (I - eps f'(x))^(-1) f(x), or M x~ = r *)
kahanMap[point_List, eps_] := Module[{},
  kahanSolve[kahanMatrix[point, eps], kahanVector[point, eps]]
];

(* Its inverse, which is the map with -eps *)
kahanInverse[point_List, eps_] := Module[{},
  kahanMap[point, -eps]
];

(* Its Jacobi matrix: (I - eps f'(x))^(-1) (I + eps f'(x~)) *)
kahanJacobian[point_List, eps_] := Module[{},
  kahanSolve[kahanMatrix[point, eps], kahanMatrix[kahanMap[point, eps], -eps]]
];

(* The Kahan map as rational functions of x and eps *)
kahanMapFormula[point_List, eps_] := Module[{x, y},
  {x, y} = point;
  {(-2*y*eps + 4*eps^2 - x)/(12*x*eps^2 - 1),
        (-12*x*y*eps^2 - 12*x^2*eps - y + 4*eps)/(12*x*eps^2 - 1)}
];

(* modified_H: the file says that it is an integral of the map *)
integralModifiedH[point_List, eps_] := Module[{x, y},
  {x, y} = point;
  (-2*x*y^2*eps^2 + 8*x^2*eps^2 + 2*x^3 - 1/2*y^2 + 8/3*eps^2 - 2*x)/(12*x*eps^2 - 1)
];

(* H + grad H . (x~ - x)/3, where f = J grad H *)
modifiedHamiltonianOf[point_List, image_List, eps_] := Module[{x, y, vXNew, vYNew},
  {x, y} = point;
  {vXNew, vYNew} = image;
  -2*x^2*vXNew + 1/6*y^2 + 1/3*y*vYNew + 4/3*x + 2/3*vXNew
];

(* An integral of the map, by a theorem *)
modifiedHamiltonian[point_List, eps_] := Module[{},
  modifiedHamiltonianOf[point, kahanMap[point, eps], eps]
];

(* phi; the file says that dx/phi is invariant under the map *)
density[point_List, eps_] := Module[{x, y},
  {x, y} = point;
  -12*x*eps^2 + 1
];
