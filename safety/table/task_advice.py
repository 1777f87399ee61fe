"""Causes and next steps of rows about the push, this machine and the program (F50 to F73)."""

from __future__ import annotations

from safety.table.advice import Advice

TASK_ADVICE: dict[str, Advice] = {
    "F50": Advice(
        "The object is too heavy or stuck, or the base has run into something else.",
        "Look at what it pushes; clear the way, or raise the limit if sensor and object allow it.",
    ),
    "F51": Advice(
        "The contact is far from the sensor's axis, or the tool has caught on something.",
        "Look where the ball touches; free the tool.",
    ),
    "F52": Advice(
        "The object turned or slid away, or it is too light to be felt.",
        "Start the push nearer to the middle of the object; lower `control.force_min_N` for a light one.",
    ),
    "F52-refused": Advice(
        "Contact was lost more often than three times.",
        "Find out why the object gets away, and start a new push.",
    ),
    "F53": Advice(
        "The object stands elsewhere, or it is too light to be felt.",
        "Place it on the path, correct `path.expected_contact_m`, or lower `control.force_min_N`.",
    ),
    "F53-early": Advice(
        "Something else stands in the way, or the sensor has drifted.",
        "Look at what the ball touched.",
    ),
    "F54": Advice(
        "The object has run against a wall or a threshold, or is much heavier than the rig says.",
        "Look what holds it; clear the way and start again.",
    ),
    "F55": Advice(
        "The path leads out of the workspace, or the object drifted to the side.",
        "Drive the base back by hand, aim again, or correct `[workspace]`.",
    ),
    "F56": Advice(
        "The force points the wrong way: wrong frames or signs, or gains that are too high for this object.",
        "Check the signs (docs/frames-and-signs.md), and the gains with `push tune`.",
    ),
    "F56-way": Advice(
        "The object has turned too far aside to be saved: a start too far off its middle or its path, or gains that "
        "are too high for it; or the force seems to point aside, by a tare or frames that are wrong.",
        "Put the ball nearer to the object's middle and aim along the path; find gains with `push tune`.",
    ),
    "F57": Advice(
        "A defect in a law of your own; the run's notes have its words.",
        "Replay the log with the law: it shows the tick at which it happened; mend the law.",
    ),
    "F57-slow": Advice(
        "A law of your own that computes for too long, reads files or waits.",
        "Let it compute beforehand what it can; raise `limits.law_ms` if the loop has the time.",
    ),
    "F58": Advice(
        "A gain or setting that is out of bounds, or a defect in a law of your own.",
        "Replay the log: it shows the tick at which it happened.",
    ),
    "F59": Advice(
        "The pose is turned against the base, wheels slip, or something pushes the base aside.",
        "Drive the base a metre straight on by hand and compare its pose.",
    ),
    "F60": Advice(
        "Other programs use the processor, or this one has no permission for real-time priority.",
        "Close other programs, and allow real-time priority as the start lines ask.",
    ),
    "F61": Advice(
        "The computer was suspended, or a virtual machine was paused.",
        "Switch sleep off on this computer, and start again.",
    ),
    "F63": Advice(
        "The disk is full or too slow, or somebody ended the recorder.",
        "Free some space, and write to a local disk.",
    ),
    "F64": Advice("The stop key, Ctrl-C or a signal.", "Start a new push when all is well."),
    "F65": Advice(
        "Somebody killed it, memory ran out, or a driver crashed.",
        "Look into the system's log for the reason; replay the push's log.",
    ),
    "F66": Advice(
        "Control hangs in a driver, or the computer stood still.",
        "Look at the loop's timing in the report; close other programs.",
    ),
    "F67": Advice(
        "The gate refused a command or its process ended; the event before says which.",
        "Read the first event of the report.",
    ),
    "F68": Advice(
        "A defect in this program, or in a driver or law of your own.",
        "Send us the traceback that the message names, and the log.",
    ),
    "F69": Advice(
        "Somebody killed it, memory ran out, or the arm's library crashed.",
        "Start again; look into the system's log if it happens again.",
    ),
    "F73": Advice(
        "The terminal's program was stopped or hangs, or the computer stood still.",
        "Start the push in a terminal that stays open, and do not suspend it.",
    ),
}
