"""Causes and next steps of rows about the start and the devices (R01 to F49)."""

from __future__ import annotations

from safety.table.advice import Advice

DEVICE_ADVICE: dict[str, Advice] = {
    "R01": Advice(
        "A device is switched off, its cable is out, or its address in the rig is another device's.",
        "See at the start lines which device gave nothing; switch it on, check its cable and its address.",
    ),
    "R02": Advice(
        "The tool was touched or still swings, the base was moving, or the sensor is noisier than the rig says.",
        "Let go of the tool, wait until all is at rest, and start again; set `ft.noise_force_N` if it is always so.",
    ),
    "R02-dead": Advice(
        "A wire or a strain gauge of that axis is broken, or the driver repeats its first reading.",
        "Press the tool along each axis and look at the readings; have the sensor repaired if one stays as it is.",
    ),
    "R02-contact": Advice(
        "The base does not touch the object, touches it from the side, or the saved tare is no longer true.",
        "Start without `--start-in-contact`, or bring the contact ball to the object and start again.",
    ),
    "R03": Advice(
        "A heavy tool, or one that is clamped against something, already uses up the sensor's range.",
        "Free the tool; mount a lighter one if it hangs free.",
    ),
    "R04": Advice(
        "The arm was moved since the rig's frames were measured, or a joint is a whole turn away.",
        "Move the arm to `arm.held_pose_rad`, or measure the frames again and write the new pose into the rig.",
    ),
    "R05": Advice(
        "Somebody drives the base with the joystick, it rolls, or its odometry is wrong at rest.",
        "Let the joystick go, see that the base stands, and look at its odometry topic.",
    ),
    "R06": Advice(
        "The distance is too long for the workspace, or the base stands elsewhere than was thought.",
        "Push less far, drive the base back, or correct `[workspace]`.",
    ),
    "R07": Advice(
        "Motion capture has the wrong origin or unit, or another thing's pose is on the topic.",
        "Look at the pose topic named in the rig; it must be in metres.",
    ),
    "F01": Advice(
        "The sensor's cable or adapter, a serial port with a long latency, or a computer that is too busy.",
        "Check plug and cable, look at the sensor's counters in the summary, and close other programs.",
    ),
    "F02": Advice(
        "The adapter was unplugged or lost its power, or another program took the port.",
        "Plug it in, check that its port is the rig's, and start again.",
    ),
    "F04": Advice(
        "A bad cable or plug, a missing shield or ground, or a motor's cable beside it.",
        "Lay the sensor's cable away from power cables, check its plugs, and watch `crc_fail` in the summary.",
    ),
    "F06": Advice(
        "The sensor or its adapter hangs and repeats old data.",
        "Switch the sensor off and on, and tare again.",
    ),
    "F07": Advice(
        "Something hard was hit, the tool is clamped, or the sensor is defective.",
        "Free the tool and look whether the reading comes back; overload may have damaged the sensor.",
    ),
    "F08": Advice(
        "A disturbance on the sensor's cable, or a hard knock on the tool.",
        "Nothing at once; if it comes often, check cable and shield.",
    ),
    "F09": Advice(
        "The tool still touches the object, something was bent, or the sensor drifted as it warmed up.",
        "Look whether the ball is free; let the sensor warm up, and do not trust the forces of this push.",
    ),
    "F09-before": Advice(
        "The tool touches something already, or the sensor drifted since the tare.",
        "Look for a cable that pulls; let the sensor warm up and start again.",
    ),
    "F10": Advice(
        "A driver of your own passes on values that are not numbers.",
        "Look at the sensor's readings alone, with the driver's snippet in the README.",
    ),
    "F11": Advice(
        "The rig's `frames.base_from_sensor` has a wrong sign or axes, or the sensor was mounted turned.",
        "Press the ball by hand against the direction of the push and compare the signs (docs/frames-and-signs.md).",
    ),
    "F12": Advice(
        "The sensor sends slowly, packets are lost, or the adapter bunches them.",
        "Set the adapter's latency timer to 1 ms; compare `packets_ok` with the declared rate.",
    ),
    "F15": Advice(
        "Somebody zeroed the arm's sensor or changed its payload at the pendant, or the sensor was overloaded.",
        "Leave zero and payload alone during a run. Where nobody touched them, look at the arm's log; then tare again.",
    ),
    "F20": Advice(
        "The force pushed the arm away from its pose, or it sank after its brakes were released.",
        "Bring the arm back to its held pose and tare again; use its brakes or a stiffer pose if it comes again.",
    ),
    "F21": Advice(
        "Somebody moved the arm, or a program on its controller moves it.",
        "Keep hands and programs off the arm during a push.",
    ),
    "F22": Advice(
        "The arm felt a collision or too large a force, or a safety fence was opened.",
        "See on the pendant what it was, release the stop there, and start again.",
    ),
    "F23": Advice(
        "The red button of the arm or of the cell was pressed.",
        "Find out why, release it, power the arm on, and start again.",
    ),
    "F24": Advice(
        "The network to the arm, a controller that restarts, or a computer that is too busy.",
        "Ping the arm's controller, check the cable, and start again.",
    ),
    "F25": Advice(
        "The arm's controller hangs or is starting, while its connection stays open.",
        "Look at the pendant; restart the controller if it does not react.",
    ),
    "F27": Advice(
        "The arm was switched off, its brakes are on, or its teach button is pressed.",
        "Power the arm on and release the brakes at the pendant, then start again.",
    ),
    "F28": Advice(
        "A program was started or left paused at the pendant or by another computer.",
        "Stop it at the pendant.",
    ),
    "F29": Advice(
        "The arm's controller or a driver of your own passes on values that are not numbers.",
        "Restart the controller; look at the joints with the driver alone.",
    ),
    "F30": Advice(
        "The bridge on the base was restarted or crashed, or the network broke.",
        "See that the bridge runs on the base and that the base stands; start again.",
    ),
    "F31": Advice(
        "Weak wireless network, a bridge that hangs, or the node that publishes odometry has died.",
        "Check the network and the odometry topic on the base.",
    ),
    "F32": Advice(
        "The network or the bridge is overloaded, so that messages queue up, or the robot's clock was set back.",
        "Close other clients of the bridge, or use a cable; let its clock be slewed (chrony), not stepped.",
    ),
    "F33": Advice(
        "A stop is pressed, the joystick or another program has priority, wheels slip, or something is in the way.",
        "Look at the stop buttons and at who else publishes commands; clear the way.",
    ),
    "F34": Advice(
        "Another program or the joystick drives the base, or the base's controller hangs.",
        "Press the emergency stop; then find out who publishes on its command topic.",
    ),
    "F35": Advice(
        "Another program drives the base too, it rolls down a slope, or odometry is wrong.",
        "Find out who publishes on its command topic; compare odometry with the real speed.",
    ),
    "F36": Advice(
        "A speed in the rig, or in a law of your own, is higher than the envelope allows.",
        "Lower the speed, or raise `limits.envelope_factor` if the faster base is meant.",
    ),
    "F37": Advice(
        "Wheels that slip, a wrong marker body, or a pose that is mirrored, scaled or turned against the base.",
        "Drive the base a metre by hand and compare its pose with its odometry.",
    ),
    "F38": Advice(
        "A stop button of the base is pressed, or its motors were not switched on.",
        "Release the stop and press reset on the base.",
    ),
    "F38-late": Advice(
        "The base's status node has ended, or the bridge no longer forwards its topic.",
        "Look at the status topic on the robot; keep a hand on the stop button, which is no longer reported.",
    ),
    "F39": Advice(
        "The base really rolls, or its odometry shows a speed at rest.",
        "See whether it stands; if so, look at its odometry.",
    ),
    "F40": Advice(
        "Motion capture lost sight of the markers, or its computer or the network stopped.",
        "Check the line of sight and the pose topic's rate.",
    ),
    "F41": Advice(
        "Motion capture confused markers, a marker fell off, or somebody reset the origin.",
        "Look at the marker body in the motion capture program.",
    ),
    "F42": Advice(
        "Motion capture lost the base and sends an empty pose, or the topic's frame is another one.",
        "Check the line of sight, and the topic's type and frame.",
    ),
    "F43": Advice(
        "Motion capture repeats an old pose, or the wheels turn on the spot.",
        "Look at the pose while the base moves by hand; check that the wheels grip.",
    ),
    "F44": Advice(
        "The object pushes the base round, a wheel slips, or the turn gain is too low.",
        "Push nearer to the middle of the object, or raise `control.heading_gain_per_s`.",
    ),
    "F45": Advice(
        "The pose does not show how far the base has gone, or the base was sent back and forth.",
        "Compare pose and odometry; look at the path in the report.",
    ),
    "F46": Advice(
        "The base hardly moves, stands still again and again, or goes in SLOW for a long time.",
        "Look in the report for what slowed it down.",
    ),
    "F47": Advice(
        "The pose does not show how far the base has gone, or control does not end the push.",
        "Compare pose and odometry; look at the path in the report.",
    ),
    "F48": Advice(
        "The base hardly moves, or control does not end the push.",
        "Look in the report for what slowed it down.",
    ),
    "F49": Advice(
        "The base's odometry sends null or NaN: its driver or its wheel encoders have failed.",
        "Look at the odometry topic on the robot, and restart its driver there.",
    ),
}
