"""Pictures, from values that were computed before: results in, figures out.

style             sizes in centimetres, fonts, colors that are distinct for the color-blind and on gray printers
figures           an empty figure in a style, its texts and legend; as a file (PDF, SVG, PNG) or as SVG inside a page
growth            degrees of iterates, heights of exact orbits
scan              the plane of two parameters, with what a scan found in it
escape            when and where orbits of a plane of initial points leave a ball
squares           do two maps commute, seen from one point
comparison        Kahan's method and others along float orbits: drift of integrals, errors, orders, work
portraits         orbits of planar maps and of sections, equilibria, the flow
curves            invariant curves, and the planes they lie in
"""
