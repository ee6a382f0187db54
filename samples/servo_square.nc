(A square with round corners at 1 m/min, for servo_three_axis.yaml: the load acts on the second and third)
G21 G17 G90 G94
G0 X30 Y0
G1 X60 F1000
G3 X80 Y20 R20
G1 Y60
G3 X60 Y80 R20
G1 X20
G3 X0 Y60 R20
G1 Y20
G3 X20 Y0 R20
G1 X30
M2
