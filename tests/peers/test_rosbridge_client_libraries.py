"""The emulated bridge with the ROS community's own client libraries: roslibpy (Twisted) and npm's roslib.

They are installed into a temporary directory; one that cannot be installed (no npm, no package index) is skipped
with what the installer said.
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.wire.bridge_process import running_bridge

pytestmark = [pytest.mark.long, pytest.mark.timeout(600)]

FEEDS = {
    "/vicon/ThingBase_4/ThingBase_4": "geometry_msgs/TransformStamped",
    "/odometry/filtered": "nav_msgs/Odometry",
    "/mcu/status": "ridgeback_msgs/Status",
    "/cmd_vel": "geometry_msgs/Twist",
}
COMMANDS = 50

ROSLIBPY = """
import collections, json, sys, time
import roslibpy
port, feeds, commands = int(sys.argv[1]), json.loads(sys.argv[2]), int(sys.argv[3])
ros = roslibpy.Ros("127.0.0.1", port)
ros.run(timeout=10)
heard = collections.Counter()
for name, kind in feeds.items():
    roslibpy.Topic(ros, name, kind, queue_length=1).subscribe(lambda message, name=name: heard.update([name]))
command = roslibpy.Topic(ros, "/cmd_vel", "geometry_msgs/Twist", queue_size=1)
command.advertise()
until = time.monotonic() + 20
while time.monotonic() < until and len(heard) < len(feeds) - 1:
    time.sleep(0.01)
for number in range(commands):
    command.publish(roslibpy.Message({"linear": {"x": 0.001 * number}}))
while time.monotonic() < until and heard["/cmd_vel"] < commands:
    time.sleep(0.01)
listeners = roslibpy.Service(ros, "/rosapi/subscribers", "rosapi/Subscribers")
print(json.dumps({
    "heard": heard, "type": ros.get_topic_type("/cmd_vel"), "topics": ros.get_topics(), "nodes": ros.get_nodes(),
    "services": ros.get_services(), "time": ros.get_time()["secs"],
    "listeners": listeners.call(roslibpy.ServiceRequest({"topic": "/cmd_vel"}), timeout=5)["subscribers"],
}))
ros.terminate()
"""

ROSLIBPY_INTERFACE = """
import json, sys, threading, time
import roslibpy
ros = roslibpy.Ros("127.0.0.1", int(sys.argv[1]))
ros.run(timeout=10)
told = {
    "service_type": ros.get_service_type("/rosapi/topics"),
    "services_for_type": ros.get_services_for_type("rosapi/Topics"),
    "request": ros.get_service_request_details("rosapi/TopicType")["typedefs"][0]["fieldnames"],
    "response": ros.get_service_response_details("rosapi/TopicType")["typedefs"][0]["fieldnames"],
    "message": [entry["type"] for entry in ros.get_message_details("geometry_msgs/Twist")["typedefs"]],
    "node": ros.get_node_details("/vicon_bridge"),
    "topics_for_type": ros.get_topics_for_type("ridgeback_msgs/Status"),
}
parameter = roslibpy.Param(ros, "/gain")
before = parameter.get()
parameter.set({"k": [1, 2.5]})
told["parameter"] = [before, parameter.get(), "/gain" in ros.get_params(), ros.get_param("/gain")]
parameter.delete()
told["parameter"].append(parameter.get())
servers = threading.Event()
ros.get_action_servers(lambda answer: servers.set())
told["action_servers"] = servers.wait(5)
try:
    roslibpy.Service(ros, "/nobody", "std_srvs/Empty").call(roslibpy.ServiceRequest(), timeout=5)
except Exception as error:
    told["refused"] = str(error)
arrivals = []
spaced = roslibpy.Topic(ros, "/odometry/filtered", "nav_msgs/Odometry", throttle_rate=200, queue_length=1)
spaced.subscribe(lambda message: arrivals.append(time.monotonic()))
until = time.monotonic() + 20
while len(arrivals) < 6 and time.monotonic() < until:
    time.sleep(0.01)
spaced.unsubscribe()
told["spacing"] = (arrivals[5] - arrivals[0]) / 5
ros.get_time()  # whatever was under way has come by now
count = len(arrivals)
notes = roslibpy.Topic(ros, "/note", "std_msgs/String", latch=True)
notes.advertise()
notes.publish(roslibpy.Message({"data": "kept"}))
heard = threading.Event()
late = roslibpy.Topic(ros, "/note", "std_msgs/String")
late.subscribe(lambda message: message["data"] == "kept" and heard.set())
told["latched"] = heard.wait(5)
notes.unadvertise()
told["after_unsubscribe"] = len(arrivals) - count
ros.terminate()
print(json.dumps(told))
"""

ROSLIB = """
import * as ROSLIB from "roslib";
const [url, feeds, commands] = [process.argv[2], JSON.parse(process.argv[3]), Number(process.argv[4])];
const ros = new ROSLIB.Ros({ url });
const heard = {};
const ask = (call, ...args) => new Promise((resolve, reject) => call.call(ros, ...args, resolve, reject));
const until = async (condition) => {
  for (const end = Date.now() + 20000; Date.now() < end && !condition(); ) await new Promise((r) => setTimeout(r, 10));
};
ros.on("error", (error) => { console.error(String(error)); process.exit(1); });
ros.on("connection", async () => {
  for (const [name, messageType] of Object.entries(feeds))
    new ROSLIB.Topic({ ros, name, messageType, queue_length: 1 })
      .subscribe(() => { heard[name] = (heard[name] ?? 0) + 1; });
  const command = new ROSLIB.Topic({ ros, name: "/cmd_vel", messageType: "geometry_msgs/Twist", queue_size: 1 });
  command.advertise();
  await until(() => Object.keys(heard).length >= Object.keys(feeds).length - 1);
  for (let number = 0; number < commands; number++) command.publish({ linear: { x: 0.001 * number } });
  await until(() => (heard["/cmd_vel"] ?? 0) >= commands);
  console.log(JSON.stringify({
    heard, type: await ask(ros.getTopicType, "/cmd_vel"), topics: (await ask(ros.getTopics)).topics,
    nodes: await ask(ros.getNodes), services: await ask(ros.getServices),
    raw: (await ask(ros.getTopicsAndRawTypes)).typedefs_full_text.length,
  }));
  process.exit(0);
});
"""


def install(*command: object, cwd: Path) -> None:
    """Install something, or skip the test with the installer's last words."""
    done = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True, timeout=400)
    if done.returncode:
        pytest.skip(f"cannot be installed here: {(done.stderr or done.stdout).strip().splitlines()[-1]}")


def talk(bridge, *command: object, cwd: Path, address: str) -> dict:
    """Run a client against the bridge; return what it saw, after checking what the base heard of it."""
    done = subprocess.run(
        [str(part) for part in command] + [address, json.dumps(FEEDS), str(COMMANDS)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    assert [entry[1] for entry in bridge.heard()] == [0.001 * number for number in range(COMMANDS)]
    seen = json.loads(done.stdout.splitlines()[-1])
    assert seen["heard"].keys() == FEEDS.keys()
    assert seen["heard"]["/cmd_vel"] == COMMANDS
    assert seen["type"] == "geometry_msgs/Twist"
    assert FEEDS.keys() <= set(seen["topics"])
    assert {"/twist_mux", "/rosapi"} <= set(seen["nodes"])
    assert "/rosapi/topic_type" in seen["services"]
    return seen


@pytest.fixture(scope="module")
def roslibpy_python(tmp_path_factory):
    """A Python of its own that has roslibpy."""
    folder = tmp_path_factory.mktemp("roslibpy")
    install(sys.executable, "-m", "venv", folder / "venv", cwd=folder)
    python = folder / "venv" / "bin" / "python"
    install(python, "-m", "pip", "install", "-q", "roslibpy", cwd=folder)
    return python


def test_roslibpy(roslibpy_python, tmp_path):
    (tmp_path / "client.py").write_text(ROSLIBPY)
    with running_bridge() as bridge:
        seen = talk(bridge, roslibpy_python, "client.py", cwd=tmp_path, address=bridge.url.rpartition(":")[2])
    assert "/twist_mux" in seen["listeners"]


def test_all_that_roslibpy_asks(roslibpy_python, tmp_path):
    (tmp_path / "client.py").write_text(ROSLIBPY_INTERFACE)
    with running_bridge() as bridge:
        line = [str(roslibpy_python), "client.py", bridge.url.rpartition(":")[2]]
        done = subprocess.run(line, cwd=tmp_path, capture_output=True, text=True, timeout=90)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["service_type"] == "rosapi/Topics"
    assert told["services_for_type"] == ["/rosapi/topics"]
    assert (told["request"], told["response"]) == (["topic"], ["type"])
    assert told["message"] == ["geometry_msgs/Twist", "geometry_msgs/Vector3"]
    assert "/vicon/ThingBase_4/ThingBase_4" in told["node"]["publishing"]
    assert told["topics_for_type"] == ["/mcu/status"]
    assert told["parameter"] == [None, {"k": [1, 2.5]}, True, {"k": [1, 2.5]}, None]
    assert told["action_servers"]
    assert "/nobody does not exist" in told["refused"]
    assert 0.18 < told["spacing"] < 0.4  # throttle_rate 200 ms on a topic of 50 Hz
    assert told["latched"]
    assert told["after_unsubscribe"] <= 1


def test_npm_roslib(tmp_path):
    if shutil.which("npm") is None or shutil.which("node") is None:
        pytest.skip("npm and node are not installed")
    install("npm", "install", "--no-audit", "--no-fund", "--prefix", tmp_path, "roslib", cwd=tmp_path)
    (tmp_path / "client.mjs").write_text(ROSLIB)
    with running_bridge() as bridge:
        seen = talk(bridge, "node", "client.mjs", cwd=tmp_path, address=bridge.url)
    assert seen["raw"] == len(seen["topics"])
