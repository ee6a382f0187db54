(Round pocket on the mill: helical entry, growing circles, a finishing turn in exact path mode)
G17 G21 G90 G94
G64 P0.01
T1 M6 G43 H1
S8000 M3 M8
G0 X0 Y0 Z5
G1 Z0.5 F600
(down a helix of radius 3, three turns)
G1 X3 F1500
G3 X3 Y0 Z-4 I-3 J0 P3
G3 I-3 J0
(outward in half turns)
G3 X-5 I-4 J0
G3 X7 I6 J0
G3 X-9 I-8 J0
G3 X11 I10 J0
G3 X-13 I-12 J0
G3 X14.8 I13.9 J0
(finish)
G61
G1 X15 F900
G3 I-15 J0
G64 P0.01
G3 X11 Y4 I0 J4
G0 Z5
M9 M5
G49
M30
