(Bracket on the XY stage: sharp corners, fillets, a bore and a slot)
(100 mm/s on a stage that rings at 30 and 100 Hz)
G17 G21 G90 G94
G64 P0.02
(outline, counter-clockwise from the lower left corner)
G0 X0 Y0
G1 X60 F6000
G1 Y18
G1 X36
G2 X32 Y22 I0 J4
G1 Y34
G3 X26 Y40 I-6 J0
G1 X6
G3 X0 Y34 I0 J-6
G1 Y0
(bore, one full turn)
G0 X27 Y28
G2 I-9 J0
(slot, two half turns)
G0 X20 Y6
G1 X48
G3 Y12 I0 J3
G1 X20
G3 Y6 I0 J-3
(zig-zag over the pad)
G0 X40 Y13.5
G1 X57
G1 Y14.5
G1 X40
G1 Y15.5
G1 X57
G1 Y16.5
G1 X40
G0 X0 Y0
M2
