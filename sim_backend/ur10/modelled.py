"""What the emulated controller models and what it refuses, in words for whoever writes a client."""

MODELLED = """\
A UR controller on one loopback address, with its arm at rest.

ports      29999 dashboard, 30004 RTDE, 30001 primary, 30002 secondary (10 Hz), 30003 real time (each control cycle:
           CB3 125 Hz, e-Series 500 Hz), packets as long as those of its PolyScope; programs on 30001 to 30003
programs   plain URScript: calls, assignments, if, while; movej, movel, servoj, speedj, speedl, stopj, stopl, sleep,
           sync, textmsg, set_tcp, set_payload, outputs, registers, kinematics. ur_rtde's control script.
motion     exact kinematics both ways by the published parameters, with the tool's offset; moves speed up and slow
           down; the speed slider counts. A target that a joint cannot follow, or a pose out of reach, is a
           protective stop.
refused    what needs a URScript interpreter (functions, threads), servoc, movep, movec, jogging, force mode, teach
           and freedrive mode, contact detection, joint torques and dynamics: the program ends with an error on the
           primary port, and one line here says why
not there  collisions, joint dynamics, blends (a path rests at each of its points), gradual stops, the pendant"""
