"""Pictures of results; each module plots values that other modules have computed.

style             sizes in centimetres, fonts, colors that color-blind readers and gray prints distinguish
figures           an empty figure in a style, texts and legends; output as a file (PDF, SVG, PNG) or as SVG in a page
growth            degrees of iterates, heights of exact orbits
scan              the plane of two parameters, with the special parameters that a scan found
escape            when and where orbits of a plane of initial points leave a ball
squares           whether two maps commute at one point
comparison        Kahan's method and other methods along float orbits: drift of integrals, errors, orders, work
portraits         orbits projected to two or three axes, equilibria, the flow (section: crossings of a hyperplane)
curves            invariant curves, and the planes that contain them (rotation: rotation numbers of their points)
"""
