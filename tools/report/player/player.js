"use strict";
// Plays the push from above and moves one cursor through all figures. Reads #course; draws into #stage.
(() => {
  const course = JSON.parse(document.getElementById("course").textContent);
  const rows = course.rows;
  if (!rows) return;

  const SVG = "http://www.w3.org/2000/svg";
  const HALF_WIDTH_M = 1.2;
  const ARROW_M = 0.35; // length of the arrow for the greatest force
  const player = document.getElementById("player");
  const stage = document.getElementById("stage");
  const button = document.getElementById("play");
  const slider = document.getElementById("time");
  const speed = document.getElementById("speed");
  const last = rows.t.length - 1;
  const known = (value) => value !== null && value !== undefined;
  const forces = rows.fx.map((fx, i) => Math.hypot(fx, rows.fy[i]));
  const greatest = forces.reduce((most, force) => Math.max(most, force), 1);

  function add(parent, name, attributes) {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    parent.append(element);
    return element;
  }

  // The stage is in metres; y to the left of the path is up.
  const world = add(stage, "g", { transform: "scale(1,-1)" });
  const marks = add(stage, "g", { class: "marks" });
  add(world, "rect", { class: "corridor", x: -2, y: -course.corridor_m, width: course.distance_m + 4, height: 2 * course.corridor_m });
  add(world, "line", { class: "path", x1: -2, y1: 0, x2: course.distance_m + 2, y2: 0 });
  const trail = add(world, "polyline", { class: "trail" });
  const body = add(world, "polygon", { class: "object" });
  const ball = add(world, "circle", { class: "ball", r: course.ball_m || 0.02 });
  const arrow = add(world, "path", { class: "arrow" });
  for (let x = -2; x <= course.distance_m + 2; x += 0.5) {
    add(world, "line", { class: "grid", x1: x, y1: -0.03, x2: x, y2: 0.03 });
    add(marks, "text", { x: x, y: 0.11 }).textContent = `${x} m`;
  }

  // A line in every axes over time, and a dot in the plan.
  const cursors = [];
  for (const figure of document.querySelectorAll("svg[data-time]")) {
    for (const axes of figure.dataset.time.split(";")) {
      const [left, top, right, bottom, from, to] = axes.split(",").map(Number);
      const line = add(figure, "line", { class: "cursor", y1: top, y2: bottom });
      cursors.push((i) => {
        const x = left + ((rows.t[i] - from) / (to - from)) * (right - left);
        line.setAttribute("x1", x);
        line.setAttribute("x2", x);
      });
    }
    const [left, , right, , from, to] = figure.dataset.time.split(",").map((n) => parseFloat(n));
    const seek = (event) => {
      const box = figure.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * figure.viewBox.baseVal.width;
      pause();
      show(nearest(from + ((x - left) / (right - left)) * (to - from)));
    };
    figure.addEventListener("pointerdown", seek);
    figure.addEventListener("pointermove", (event) => event.buttons && seek(event));
  }
  for (const figure of document.querySelectorAll("svg[data-plan]")) {
    const [left, top, right, bottom, x0, x1, y0, y1] = figure.dataset.plan.split(",").map(Number);
    const dot = add(figure, "circle", { class: "dot", r: 5 });
    cursors.push((i) => {
      if (!known(rows.x[i]) || !known(rows.y[i])) return;
      dot.setAttribute("cx", left + ((rows.x[i] - x0) / (x1 - x0)) * (right - left));
      dot.setAttribute("cy", bottom - ((rows.y[i] - y0) / (y1 - y0)) * (bottom - top));
    });
  }

  function nearest(time) {
    let low = 0, high = last;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (rows.t[middle] < time) low = middle + 1; else high = middle;
    }
    return low;
  }

  function points(list) {
    return list.map(([x, y]) => `${x},${y}`).join(" ");
  }

  function drawBody(i) {
    const [x, y, yaw] = rows.ox ? [rows.ox[i], rows.oy[i], rows.oyaw[i]] : [];
    if (!known(x) || !known(y) || !known(yaw)) return body.setAttribute("points", "");
    const [c, s] = [Math.cos(yaw), Math.sin(yaw)];
    const shape = course.outline.length ? course.outline : [[0, -0.01], [0.15, -0.01], [0.15, 0.01], [0, 0.01]];
    body.setAttribute("points", points(shape.map(([bx, by]) => [x + c * bx - s * by, y + s * bx + c * by])));
  }

  function drawArrow(i, x, y) {
    const length = (ARROW_M * forces[i]) / greatest;
    if (!(length > 0.01)) return arrow.setAttribute("d", "");
    const [c, s] = [rows.fx[i] / forces[i], rows.fy[i] / forces[i]];
    const [ex, ey] = [x + c * length, y + s * length];
    const wing = (side) => `${ex - 0.05 * c - side * 0.025 * s},${ey - 0.05 * s + side * 0.025 * c}`;
    arrow.setAttribute("d", `M${x},${y} L${ex},${ey} M${wing(1)} L${ex},${ey} L${wing(-1)}`);
  }

  function tell(i) {
    const number = (value, digits, unit) => (known(value) ? `${value.toFixed(digits)} ${unit}` : "–");
    const words = {
      "at-time": number(rows.t[i], 1, "s"),
      "at-phase": course.phases[rows.phase[i]] || "–",
      "at-along": number(rows.x[i], 2, "m"),
      "at-left": number(rows.y[i], 3, "m"),
      "at-force": number(forces[i], 1, "N"),
      "at-angles": `${number(rows.theta_f[i], 0, "°")} / ${number(rows.theta_p[i], 0, "°")}`,
    };
    for (const [id, text] of Object.entries(words)) document.getElementById(id).textContent = text;
    slider.setAttribute("aria-valuetext", `${words["at-time"]}, ${words["at-phase"]}, ${words["at-along"]}`);
  }

  let now = 0;
  function show(i) {
    now = Math.min(Math.max(i, 0), last);
    slider.value = now;
    const [x, y] = [rows.x[now], rows.y[now]];
    if (known(x) && known(y)) {
      const height = (2 * HALF_WIDTH_M * stage.clientHeight) / Math.max(stage.clientWidth, 1) || HALF_WIDTH_M;
      stage.setAttribute("viewBox", `${x - 0.8 * HALF_WIDTH_M} ${-y - height / 2} ${2 * HALF_WIDTH_M} ${height}`);
      ball.setAttribute("cx", x);
      ball.setAttribute("cy", y);
      const passed = [];
      for (let k = now; k >= 0 && passed.length < 1500; k--) if (known(rows.x[k]) && known(rows.y[k])) passed.push([rows.x[k], rows.y[k]]);
      trail.setAttribute("points", points(passed));
      drawArrow(now, x, y);
    }
    drawBody(now);
    for (const move of cursors) move(now);
    tell(now);
  }

  let playing = 0; // the request for the next frame, 0 while paused
  let clock = 0; // s of the run
  let before = 0; // ms of the page
  function step(stamp) {
    clock += ((stamp - before) / 1000) * Number(speed.value);
    before = stamp;
    show(nearest(clock));
    if (now === last) return pause();
    playing = requestAnimationFrame(step);
  }
  function play() {
    if (now === last) show(0);
    clock = rows.t[now];
    before = performance.now();
    button.textContent = "Pause";
    playing = requestAnimationFrame(step);
  }
  function pause() {
    cancelAnimationFrame(playing);
    playing = 0;
    button.textContent = "Play";
  }

  slider.max = last;
  slider.addEventListener("input", () => { pause(); show(Number(slider.value)); });
  button.addEventListener("click", () => (playing ? pause() : play()));
  addEventListener("resize", () => show(now));
  player.hidden = false;
  show(nearest(course.first_contact_s));
})();
