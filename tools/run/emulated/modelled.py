"""What the emulated devices model and what they do not, as `push emulate DEVICE --help` says it."""

FT300 = """\
A Robotiq FT 300 as a serial port (a pty).

modelled: Modbus RTU (functions 3 and 16, slave 9), registers 180-185 (force,
  torque), 190-192 (acceleration), 410 (output), 500-502 (firmware), 510-514
  (serial number, year); the data stream of 100.016 Hz, started by register
  410 and stopped by 50 x 0xFF, deaf to requests meanwhile; 19200 baud byte by
  byte in both directions, also while the port is closed and opened again;
  bytes that collide on the half-duplex line; the adapter's latency timer,
  which starts with the opening of the port; garbage at any other speed.
not modelled: parity (a pty refuses it), modem lines, USB frames. Closing the
  port does not wait until everything is sent, as that of a real one does: the
  port counts as closed until then.
assumed, since nobody has documented it: answers after 2 ms; an exception for
  unknown registers; the stream falls silent with the byte that stops it;
  forces beyond the range are clipped."""

RIDGEBACK = """\
A Clearpath Ridgeback behind rosbridge (a websocket with JSON), and motion
  capture as vicon_bridge publishes it.

modelled: advertise, publish, subscribe (throttle_rate, queue_length), their
  opposites, call_service, fragments from the client; silence on every error,
  a connection that a message cut short breaks for good, commands delivered
  late and in a burst after a hang; all services of rosapi but those about
  actions, in the spelling of ROS 1 or ROS 2 (base.topics.ros_version);
  twist_mux with joystick and lock; the base: 25 Hz, limits of speed and
  acceleration, a stop 0.25 s after the last command, NaN as full speed
  backwards; odometry, filtered odometry, status, poses, joint states.
not modelled: cbor and png (plain JSON is sent), fragments to the client,
  services of clients (no answer), actions (refused), authentication, tf,
  parameters of ROS 2's nodes (refused).
faults: `push doctor emulated --fault base.cold`, and others named there."""
