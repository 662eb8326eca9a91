// Draws a running session: what /live sends is kept, and drawn once a frame. Nothing here answers back.

const SECONDS_SHOWN = 10;
const COLOURS = 8;
const element = (id) => document.getElementById(id);
const styles = getComputedStyle(document.documentElement);
const colour = (name) => styles.getPropertyValue(`--${name}`).trim();
const userColour = (index) => colour(`user-${index % COLOURS}`);

let about = null;
let predicted = null;
let latest = null;
let history = []; // { time_s, forces: [N a host] }
let paused = false;
let changed = false;

function connect(delay_ms) {
  const socket = new WebSocket(`ws://${location.host}/live`);
  socket.onopen = () => { delay_ms = 500; };
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = (event) => {
    const ended = latest?.ended;
    element("state").textContent = event.reason || (ended ? "the session is over" : "the server is gone; asking again");
    setTimeout(() => connect(Math.min(2 * delay_ms, 8000)), delay_ms);
  };
}

function take(message) {
  if (message.about) {
    about = message.about;
    predicted = message.predicted;
    latest = null;
    history = [];
    introduce();
  } else {
    latest = message;
    const forces = latest.hosts.map(forceOf);
    const last = history.at(-1);
    if (!last || latest.time_s > last.time_s) history.push({ time_s: latest.time_s, forces });
    while (history.length > 2 && history[0].time_s < latest.time_s - SECONDS_SHOWN) history.shift();
  }
  changed = true;
}

const isLine = () => about?.space === "line";
const size = (vector) => Math.hypot(...vector);
// On a line the force along it; elsewhere the size of the largest on a finger.
const forceOf = (host) => (isLine()
  ? host.fingers[0]?.commanded.force[0] ?? 0
  : Math.max(0, ...host.fingers.map((finger) => size(finger.commanded.force))));
const number = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
const nameOf = (host) => about?.users[host] ?? `host ${host + 1}`;

function introduce() {
  element("scene").textContent = about.scene;
  document.title = `${about.scene} – cotouch`;
  const rates = `${number(about.control_hz, 0)} Hz haptic, ${number(about.network_hz, 0)} Hz network`;
  element("description").textContent = about.description;
  const delay = `${about.delay_periods} network period${about.delay_periods === 1 ? "" : "s"} of delay`;
  element("rates").textContent = `${about.architecture}, ${about.users.length} users, ${rates}, ${delay}`;
  const detail = predicted ? `spectral radius ${number(predicted.spectral_radius, 4)}` : "no prediction";
  verdict("predicted", predicted?.stable, detail);
}

function verdict(id, stable, detail) {
  const box = element(id);
  const known = typeof stable === "boolean";
  box.className = `verdict ${known ? (stable ? "stable" : "unstable") : ""}`;
  box.querySelector("strong").textContent = known ? (stable ? "stable" : "unstable") : "–";
  box.querySelector(".detail").textContent = detail;
}

function frame() {
  if (changed && latest && about && !paused) {
    changed = false;
    if (isLine()) drawLine(); else drawTop();
    drawForces();
    fillFigures();
    verdict("observed", latest.stable, latest.stable === null ? "too early to say" : "so far");
    const both = typeof latest.stable === "boolean" && typeof predicted?.stable === "boolean";
    element("disagreement").hidden = !(both && latest.stable !== predicted.stable);
    element("state").textContent = latest.ended
      ? `over after ${number(latest.time_s, 1)} s` : `running, ${number(latest.time_s, 1)} s`;
  }
  requestAnimationFrame(frame);
}

// A canvas with one unit a CSS pixel, cleared.
function sheet(id) {
  const canvas = element(id);
  const { width, height } = canvas.getBoundingClientRect();
  const scale = window.devicePixelRatio || 1;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  return { context, width, height };
}

// Half the width of what is shown, m: grows at once, shrinks slowly, so that the picture is calm.
let reach_m = 0.02;
function updateReach() {
  const axes = isLine() ? [0] : [0, 1];
  const points = latest.hosts.flatMap((host) => [
    ...host.fingers.map((finger) => finger.reading.pose.position), ...host.bodies.map((body) => body.position)]);
  points.push(...about.walls.map((wall) => wall.point_m));
  const positions = points.flatMap((point) => axes.map((axis) => point[axis]));
  const needed = Math.max(0.01, 1.15 * Math.max(...positions.map((x) => (Number.isFinite(x) ? Math.abs(x) : 0))));
  reach_m = needed > reach_m ? needed : reach_m + 0.01 * (needed - reach_m);
}

function drawLine() {
  const { context, width, height } = sheet("world");
  updateReach();
  const label = Math.min(90, width * 0.2);
  const x = (metres) => label + (width - label) * (0.5 + 0.46 * metres / reach_m);
  drawAxis(context, x, width, height, label);
  const hosts = latest.hosts;
  const row = (height - 26) / Math.max(1, hosts.length);
  const size = Math.max(10, Math.min(34, 0.42 * row));
  hosts.forEach((host, index) => {
    const middle = row * (index + 0.5);
    context.fillStyle = colour("text");
    context.textAlign = "left";
    context.fillText(nameOf(host.host), 2, middle + 4, label - 6);
    if (about.copies) {
      for (const other of hosts) {
        if (other !== host) other.bodies.forEach((body) => outline(context, x(body.position[0]), middle, size, other.host));
      }
    }
    host.bodies.forEach((body) => drawObject(context, x(body.position[0]), middle, size, host));
    host.fingers.forEach((finger) => drawHand(context, x(finger.reading.pose.position[0]), middle, size, host, finger, width));
  });
}

function drawAxis(context, x, width, height, label) {
  context.strokeStyle = colour("line");
  context.fillStyle = colour("quiet");
  context.textAlign = "center";
  const step = niceStep(reach_m / 2);
  for (let k = Math.ceil(-reach_m / step); k * step <= reach_m; k++) {
    const at = x(k * step);
    line(context, at, 0, at, height - 20);
    if (at > label) context.fillText(`${number(1000 * k * step, step < 0.001 ? 1 : 0)}${k === 0 ? " mm" : ""}`, at, height - 5);
  }
  for (const wall of about.walls) {
    context.save();
    context.strokeStyle = colour("text");
    context.lineWidth = 4;
    line(context, x(wall.point_m[0]), 0, x(wall.point_m[0]), height - 20);
    context.restore();
  }
}

// From above: x to the right, y up. Every copy of every body, walls, fingers and the forces on them.
function drawTop() {
  const { context, width, height } = sheet("world");
  updateReach();
  const scale = 0.46 * Math.min(width, height) / reach_m;
  const place = (point) => [0.5 * width + scale * point[0], 0.5 * height - scale * point[1]];
  context.strokeStyle = colour("text");
  for (const wall of about.walls) drawWall(context, place, wall);
  latest.hosts.forEach((host, index) => {
    host.bodies.forEach((pose, body) => drawBody(context, place(pose.position), scale, pose, about.bodies[body], host, index === 0));
  });
  for (const host of latest.hosts) for (const finger of host.fingers) drawFinger(context, place, scale, finger, host);
}

function drawWall(context, place, wall) {
  const [x, y] = wall.point_m, [nx, ny] = wall.normal;
  context.lineWidth = 3;
  line(context, ...place([x - 10 * ny, y + 10 * nx]), ...place([x + 10 * ny, y - 10 * nx]));
}

function drawBody(context, [x, y], scale, pose, body, host, filled) {
  const [qx, qy, qz, qw] = pose.orientation;
  context.save();
  context.translate(x, y);
  context.rotate(-Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)));
  context.beginPath();
  const radius = Math.max(3, scale * body.radius_m);
  if (body.kind === "box") {
    context.rect(-0.5 * scale * body.size_m[0], -0.5 * scale * body.size_m[1], scale * body.size_m[0], scale * body.size_m[1]);
  } else if (body.kind === "capsule") {
    const half = 0.5 * scale * body.length_m;
    context.arc(0, -half, radius, Math.PI, 0);
    context.arc(0, half, radius, 0, Math.PI);
    context.closePath();
  } else {
    context.arc(0, 0, radius, 0, 2 * Math.PI);
  }
  context.strokeStyle = host.diverged ? colour("bad") : userColour(host.host);
  context.lineWidth = host.touches_wall ? 3 : 1.5;
  if (filled) {
    context.globalAlpha = 0.2;
    context.fillStyle = userColour(host.host);
    context.fill();
    context.globalAlpha = 1;
  } else {
    context.setLineDash([4, 3]);
  }
  context.stroke();
  context.restore();
}

// A disc; a ring around it while it sticks to a body, a broken one while it slides.
function drawFinger(context, place, scale, finger, host) {
  const [x, y] = place(finger.reading.pose.position);
  const radius = Math.max(3, scale * about.finger_radius_m);
  context.save();
  context.fillStyle = userColour(host.host);
  context.strokeStyle = userColour(host.host);
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
  if (finger.contact !== "free") {
    if (finger.contact === "slide") context.setLineDash([3, 3]);
    context.beginPath();
    context.arc(x, y, radius + 3, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
  }
  const [fx, fy] = finger.commanded.force;
  const length = 60 / forceScale();
  context.lineWidth = 2;
  line(context, x, y, x + length * fx, y - length * fy);
  context.restore();
}

function outline(context, x, y, size, host) {
  context.save();
  context.setLineDash([4, 3]);
  context.strokeStyle = userColour(host);
  context.strokeRect(x - size / 2, y - size / 2, size, size);
  context.restore();
}

function drawObject(context, x, y, size, host) {
  context.save();
  context.fillStyle = userColour(host.host);
  context.globalAlpha = 0.3;
  context.fillRect(x - size / 2, y - size / 2, size, size);
  context.globalAlpha = 1;
  context.lineWidth = host.touches_wall ? 3 : 1.5;
  context.strokeStyle = host.diverged ? colour("bad") : userColour(host.host);
  context.strokeRect(x - size / 2, y - size / 2, size, size);
  context.restore();
}

function drawHand(context, x, y, size, host, finger, width) {
  context.fillStyle = userColour(host.host);
  context.beginPath();
  context.arc(x, y, size / 4, 0, 2 * Math.PI);
  context.fill();
  const force = finger.commanded.force[0];
  const length = 0.25 * width * Math.max(-1, Math.min(1, force / forceScale()));
  if (Math.abs(length) > 2) arrow(context, x, y - size / 2 - 6, length);
}

function arrow(context, x, y, length) {
  context.strokeStyle = context.fillStyle;
  context.lineWidth = 2;
  line(context, x, y, x + length, y);
  const head = Math.sign(length) * Math.min(6, Math.abs(length));
  context.beginPath();
  context.moveTo(x + length, y);
  context.lineTo(x + length - head, y - 4);
  context.lineTo(x + length - head, y + 4);
  context.fill();
  context.lineWidth = 1;
}

function forceScale() {
  let largest = 0.1;
  for (const sample of history) for (const force of sample.forces) if (Number.isFinite(force)) largest = Math.max(largest, Math.abs(force));
  return largest;
}

function drawForces() {
  const { context, width, height } = sheet("forces");
  const left = 44, bottom = height - 20;
  const top = 1.1 * forceScale();
  const end = latest.time_s;
  const start = Math.max(0, end - SECONDS_SHOWN);
  const x = (time_s) => left + (width - left) * (time_s - start) / Math.max(1, Math.min(SECONDS_SHOWN, end));
  const least = isLine() ? -top : 0;
  const y = (force) => bottom * (top - force) / (top - least);
  context.strokeStyle = colour("line");
  context.fillStyle = colour("quiet");
  context.textAlign = "right";
  const step = niceStep(top / 2);
  for (let k = Math.ceil(least / step); k * step <= top; k++) {
    line(context, left, y(k * step), width, y(k * step));
    context.fillText(number(k * step, step < 0.1 ? 2 : step < 1 ? 1 : 0), left - 6, y(k * step) + 4);
  }
  context.textAlign = "center";
  for (let second = Math.ceil(start); second <= end; second++) {
    if (second % 2 === 0 && x(second) < width - 16) context.fillText(`${second} s`, x(second), height - 4);
  }
  latest.hosts.forEach((host, index) => {
    context.strokeStyle = userColour(host.host);
    context.lineWidth = 1.5;
    context.beginPath();
    for (const sample of history) context.lineTo(x(sample.time_s), y(sample.forces[index] ?? 0));
    context.stroke();
  });
  context.lineWidth = 1;
}

function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

function niceStep(about) {
  const power = 10 ** Math.floor(Math.log10(about));
  return [5, 2, 1].map((factor) => factor * power).find((step) => step <= about) ?? power;
}

function fillFigures() {
  const body = element("figures");
  while (body.rows.length > latest.hosts.length) body.deleteRow(-1);
  latest.hosts.forEach((host, index) => {
    const row = body.rows[index] ?? newRow(body);
    const links = host.links.filter((link) => link.present);
    const worst = (of) => links.length ? Math.max(...links.map(of).map((value) => value ?? NaN)) : NaN;
    const lost = host.links.reduce((sum, link) => sum + link.lost, 0);
    row.querySelector(".swatch").className = `swatch user-${host.host % COLOURS}`;
    const texts = [
      nameOf(host.host), number(forceOf(host), 2), number(host.lateness_us, 0), String(host.missed),
      number(worst((link) => link.round_trip_ms), 2), number(worst((link) => link.rms_jitter_ms), 2), String(lost),
    ];
    row.querySelector(".name").textContent = texts[0];
    texts.slice(1).forEach((text, column) => { row.cells[column + 1].textContent = text; });
  });
}

function newRow(body) {
  const row = body.insertRow();
  const head = document.createElement("th");
  head.scope = "row";
  const swatch = document.createElement("span");
  swatch.className = "swatch";
  const name = document.createElement("span");
  name.className = "name";
  head.append(swatch, name);
  row.append(head);
  for (let column = 0; column < 6; column++) row.insertCell();
  return row;
}

element("pause").addEventListener("click", (event) => {
  paused = !paused;
  event.target.textContent = paused ? "Go on" : "Pause";
  event.target.setAttribute("aria-pressed", String(paused));
});
addEventListener("resize", () => { changed = true; });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { changed = true; });

connect(500);
requestAnimationFrame(frame);
