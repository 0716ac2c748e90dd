// The map from above: the grid, zones, places, the robot with its trail, what it sees, its way, and people.
// It draws what the live stream brings, the last state wins; of a recorded run the way that was driven.
import { live } from "florence-live";

const COLOURS = {
  robot: "#1f6fd6", trail: "#9bbce6", scan: "#d9502e", plan: "#4a9be8", goal: "#2a9d3f", old: "#999",
  chosen: "#c2185b", person: "#8e44ad", keep_out: "rgba(200, 40, 40, .25)", slow: "rgba(230, 170, 0, .25)", place: "#555",
};
const FONT = "12px sans-serif";
const MOST_TRAIL = 600;
const LAYERS = [
  { name: "global_costmap", icon: "layers", title: "what a way costs (global costmap)" },
  { name: "local_costmap", icon: "grid_on", title: "what is near the robot (local costmap)" },
  { name: "camera", icon: "photo_camera", title: "what the camera sees" },
];

export default {
  template: `<div style="position:relative;width:100%;height:100%;min-height:16rem;overflow:hidden;touch-action:none">
    <canvas ref="canvas" style="width:100%;height:100%;display:block" aria-label="map"></canvas>
    <div style="position:absolute;left:.5rem;bottom:.4rem;font:12px sans-serif;color:#555">{{ pointer }}</div>
    <div style="position:absolute;right:.5rem;top:.5rem;display:flex;gap:.25rem" class="text-xl">
      <button v-for="tool in tools" :key="tool.icon" @click="tool.use" :title="tool.title" :aria-label="tool.title" :aria-pressed="tool.on"
        :style="{background: 'rgba(255,255,255,.8)', borderRadius: '.2rem', color: tool.on ? '#c2185b' : '#333'}"><i class="material-icons" style="display:block">{{ tool.icon }}</i></button>
    </div>
    <img v-if="camera" :src="camera" alt="what the camera sees" style="position:absolute;right:.5rem;bottom:.5rem;width:min(20rem,45%);border:2px solid #fff;border-radius:.3rem">
    <div v-if="!has_map" style="position:absolute;inset:0;display:grid;place-items:center;color:#777">no map has come yet</div>
  </div>`,
  props: { footprint: Array, picking: Boolean, plain: Boolean, chosen: Array, path: Array },
  emits: ["place"],
  data() { return { pointer: "", following: false, has_map: false, picks: this.picking, shown: {}, camera: "" }; },
  created() { this.unwant = {}; },
  computed: {
    tools() {
      return [
        ...(this.path || this.plain ? [] : [{ icon: "add_location", title: "choose a pose: press, and drag for the heading", on: this.picks, use: () => { this.picks = !this.picks; } }]),
        ...(this.path || this.picking || this.plain ? [] : LAYERS.map((each) => ({ ...each, on: Boolean(this.shown[each.name]), use: () => this.show(each.name) }))),
        { icon: "zoom_out_map", title: "whole map", on: false, use: () => this.fit() },
        ...(this.path ? [] : [{ icon: "my_location", title: "follow the robot", on: this.following, use: () => { this.following = !this.following; } }]),
      ];
    },
  },
  mounted() {
    this.view = null; this.trail = []; this.image = null; this.parts = {}; this.pick = null;
    this.layers = {};
    const ceases = [live.listen((parts) => this.take(parts)), ...(this.path ? [] : [live.want("scene")])];
    this.leave = () => [...ceases, ...Object.values(this.unwant)].forEach((each) => each());
    this.observer = new ResizeObserver(() => this.draw_soon());
    this.observer.observe(this.$el);
    this.listen();
  },
  unmounted() { this.leave(); this.observer.disconnect(); },
  watch: { chosen() { this.pick = null; this.draw_soon(); }, following() { this.draw_soon(); } },
  methods: {
    // Begin to show a layer, or cease.
    show(name) {
      this.shown[name] = !this.shown[name];
      if (this.shown[name]) this.unwant[name] = live.want(name);
      else { this.unwant[name](); delete this.unwant[name]; delete this.layers[name]; this.camera = this.shown.camera ? this.camera : ""; }
      this.draw_soon();
    },
    take_layers(parts) {
      for (const { name } of LAYERS) {
        if (!(name in parts)) continue;
        const part = parts[name];
        if (!part) { delete this.layers[name]; if (name === "camera") this.camera = ""; } // it has ended
        if (!part || !this.shown[name]) continue;
        const source = `picture/${name}?v=${part.version.join("-")}`;
        if (name === "camera") { this.camera = source; continue; }
        const image = new Image();
        image.onload = () => { if (this.shown[name] && this.parts[name] === part) this.layers[name] = { ...part, image }; this.draw_soon(); };
        image.src = source;
      }
    },
    // Of a recorded run: the way up to the moment that is looked at.
    show_way(points, person) {
      this.trail = this.path.slice(0, points);
      const people = person ? [{ x: person[0], y: person[1], text: "was found here" }] : [];
      this.parts.scene = { pose: this.trail[this.trail.length - 1], people };
      if (!this.view) this.fit();
      this.draw_soon();
    },
    take({ scene, plan, goal, ...parts }) {
      Object.assign(this.parts, parts); this.take_layers(parts);
      if (!this.path) this.see(Object.fromEntries(Object.entries({ scene, plan, goal }).filter(([, part]) => part !== undefined)));
      if (parts.map) {
        const image = new Image();
        image.onload = () => { this.image = { ...parts.map, image }; this.has_map = true; if (!this.view || this.path) this.fit(); this.draw_soon(); };
        image.src = `picture/map?v=${parts.map.version.join("-")}`;
      }
      this.draw_soon();
    },
    see(parts) {
      Object.assign(this.parts, parts);
      const pose = parts.scene && parts.scene.pose;
      if (this.plain && parts.scene && !pose) this.trail = []; // the next robot in the rig begins elsewhere
      if (!pose) return;
      const last = this.trail[this.trail.length - 1];
      if (!last || Math.hypot(last[0] - pose[0], last[1] - pose[1]) > 0.05) this.trail.push(pose);
      if (this.trail.length > MOST_TRAIL) this.trail.shift();
    },
    fit() {
      const map = this.parts.map || this.ground(); if (!map) return;
      const { clientWidth: width, clientHeight: height } = this.$refs.canvas;
      const scale = 0.95 * Math.min(width / map.size[0], height / map.size[1]);
      this.view = { scale, x: map.origin[0] + map.size[0] / 2, y: map.origin[1] + map.size[1] / 2 };
      this.following = false; this.draw_soon();
    },
    // Without a map: the ground that a recorded way covers.
    ground() {
      if (!this.path || !this.path.length) return null;
      const [xs, ys] = [0, 1].map((i) => this.path.map((pose) => pose[i]));
      const [x, y] = [Math.min(...xs) - 1, Math.min(...ys) - 1];
      return { origin: [x, y, 0], size: [Math.max(...xs) + 1 - x, Math.max(...ys) + 1 - y] };
    },
    draw_soon() {
      if (!this.due) this.due = requestAnimationFrame(() => { this.due = 0; this.draw(); });
    },
    to_map(event) {
      const box = this.$refs.canvas.getBoundingClientRect();
      return [
        this.view.x + (event.clientX - box.left - box.width / 2) / this.view.scale,
        this.view.y - (event.clientY - box.top - box.height / 2) / this.view.scale,
      ];
    },
    listen() {
      const canvas = this.$refs.canvas; const fingers = new Map(); let moved = 0, turning = false;
      canvas.addEventListener("wheel", (event) => {
        if (!this.view) return;
        event.preventDefault(); this.zoom(Math.exp(-event.deltaY / 500), event);
      }, { passive: false });
      canvas.addEventListener("pointerdown", (event) => {
        canvas.setPointerCapture(event.pointerId); fingers.set(event.pointerId, event); moved = 0;
        turning = Boolean(this.view) && fingers.size === 1 && (this.picks || event.shiftKey);
        if (turning) { this.pick = [...this.to_map(event), null]; this.draw_soon(); }
      });
      canvas.addEventListener("pointermove", (event) => {
        if (!this.view) return;
        const before = fingers.get(event.pointerId);
        if (!before) {
          const [x, y] = this.to_map(event); this.pointer = `${x.toFixed(2)} m, ${y.toFixed(2)} m`; return;
        }
        const dx = event.clientX - before.clientX, dy = event.clientY - before.clientY;
        moved += Math.abs(dx) + Math.abs(dy);
        if (turning && fingers.size === 1) {
          const [x, y] = this.to_map(event);
          if (moved > 6) this.pick[2] = Math.atan2(y - this.pick[1], x - this.pick[0]);
          this.draw_soon();
        } else if (fingers.size === 2) {
          turning = false; this.pick = null;
          const other = [...fingers.values()].find((each) => each.pointerId !== event.pointerId);
          const length = (a) => Math.hypot(a.clientX - other.clientX, a.clientY - other.clientY) || 1;
          this.zoom(length(event) / length(before), other);
        } else {
          this.following = false;
          this.view.x -= dx / this.view.scale; this.view.y += dy / this.view.scale; this.draw_soon();
        }
        fingers.set(event.pointerId, event);
      });
      const up = (event) => {
        const was = fingers.delete(event.pointerId);
        if (this.path) return;
        if (!was || event.type !== "pointerup" || !this.view || (!turning && moved >= 6)) return;
        const [x, y, yaw] = turning ? this.pick : [...this.to_map(event), null];
        turning = false;
        this.pick = [x, y, yaw ?? this.heading_to(x, y)];
        this.$emit("place", { x, y, yaw: this.pick[2] }); this.draw_soon();
      };
      canvas.addEventListener("pointerup", up); canvas.addEventListener("pointercancel", up);
    },
    // Without a heading that was dragged: that of a robot which comes the straight way.
    heading_to(x, y) {
      const pose = this.parts.scene && this.parts.scene.pose;
      return pose ? Math.atan2(y - pose[1], x - pose[0]) : 0;
    },
    zoom(factor, event) {
      const before = this.to_map(event);
      this.view.scale = Math.min(500, Math.max(3, this.view.scale * factor));
      const after = this.to_map(event);
      this.view.x += before[0] - after[0]; this.view.y += before[1] - after[1]; this.draw_soon();
    },
    draw() {
      const canvas = this.$refs.canvas; if (!canvas) return;
      const ratio = window.devicePixelRatio || 1;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      if (canvas.width !== width * ratio || canvas.height !== height * ratio) {
        canvas.width = width * ratio; canvas.height = height * ratio;
      }
      const c = canvas.getContext("2d");
      c.setTransform(ratio, 0, 0, ratio, 0, 0); c.fillStyle = "#d6d6d6"; c.fillRect(0, 0, width, height);
      if (!this.view) return;
      const { scene = {}, plan, goal, zones, places } = this.parts;
      if (this.following && scene.pose) [this.view.x, this.view.y] = scene.pose;
      const { scale } = this.view, px = 1 / scale;
      c.translate(width / 2, height / 2); c.scale(scale, -scale); c.translate(-this.view.x, -this.view.y);
      if (this.image) this.grid(c, this.image, this.image.image);
      for (const name of ["global_costmap", "local_costmap"]) {
        if (this.layers[name]) this.grid(c, this.layers[name], this.layers[name].image);
      }
      for (const zone of zones || []) this.polygon(c, zone.corners, COLOURS[zone.kind]);
      for (const place of places || []) this.circle(c, place.x, place.y, Math.max(0.05, 3 * px), COLOURS.place);
      this.line(c, this.trail, COLOURS.trail, 2 * px);
      const old_drive = "navigation" in (this.parts.silent || {});
      if (plan && plan.length) this.line(c, plan, old_drive ? COLOURS.old : COLOURS.plan, 2 * px, [6 * px, 4 * px]);
      if (goal) this.arrow(c, goal, 0.25, old_drive ? COLOURS.old : COLOURS.goal);
      const chosen = this.pick || this.chosen;
      if (chosen) this.arrow(c, [chosen[0], chosen[1], chosen[2] ?? 0], Math.max(0.35, 22 * px), COLOURS.chosen);
      c.fillStyle = COLOURS.scan;
      const dot = Math.max(0.03, 2.5 * px), scan = scene.scan || [];
      for (let i = 0; i + 1 < scan.length; i += 2) c.fillRect(scan[i] - dot / 2, scan[i + 1] - dot / 2, dot, dot);
      for (const person of scene.people || []) {
        this.circle(c, person.x, person.y, 0.25, COLOURS.person); this.text(c, person.text, person.x, person.y + 0.35, px);
      }
      if (scene.pose) {
        const [sx, sy] = scene.deviation || [0, 0];
        c.fillStyle = "rgba(31, 111, 214, .15)"; c.beginPath();
        c.ellipse(scene.pose[0], scene.pose[1], 2 * sx, 2 * sy, 0, 0, 2 * Math.PI); c.fill();
        c.save(); c.translate(scene.pose[0], scene.pose[1]); c.rotate(scene.pose[2]);
        this.polygon(c, this.footprint || [], COLOURS.robot); c.restore();
        this.arrow(c, scene.pose, 0.3, "#fff");
      }
      this.labels(c, places || [], px);
    },
    grid(c, { origin, size }, image) {
      c.save(); c.translate(origin[0], origin[1]); c.rotate(origin[2]);
      c.translate(0, size[1]); c.scale(1, -1); c.imageSmoothingEnabled = this.view.scale < 30;
      c.drawImage(image, 0, 0, size[0], size[1]); c.restore();
    },
    line(c, points, colour, width, dash = []) {
      if (points.length < 2) return;
      c.strokeStyle = colour; c.lineWidth = width; c.setLineDash(dash); c.beginPath();
      points.forEach((point, i) => (i ? c.lineTo(point[0], point[1]) : c.moveTo(point[0], point[1])));
      c.stroke(); c.setLineDash([]);
    },
    polygon(c, corners, colour) {
      if (!corners.length) return;
      c.fillStyle = colour; c.beginPath();
      corners.forEach((corner, i) => (i ? c.lineTo(corner[0], corner[1]) : c.moveTo(corner[0], corner[1])));
      c.closePath(); c.fill();
    },
    circle(c, x, y, radius, colour) {
      c.fillStyle = colour; c.beginPath(); c.arc(x, y, radius, 0, 2 * Math.PI); c.fill();
    },
    arrow(c, [x, y, yaw], length, colour) {
      c.save(); c.translate(x, y); c.rotate(yaw); c.fillStyle = colour; c.beginPath();
      c.moveTo(length / 2, 0); c.lineTo(-length / 3, length / 3); c.lineTo(-length / 6, 0);
      c.lineTo(-length / 3, -length / 3); c.closePath(); c.fill(); c.restore();
    },
    // Rooms first; a label that would lie on another one waits until the map is larger.
    labels(c, places, px) {
      const taken = [];
      c.font = FONT;
      for (const { label, x, y } of [...places].sort((a, b) => (b.kind === "room") - (a.kind === "room"))) {
        const half = c.measureText(label).width * px / 2;
        if (taken.some((other) => Math.abs(x - other.x) < half + other.half && Math.abs(y - other.y) < 13 * px)) continue;
        taken.push({ x, y, half }); this.text(c, label, x, y - 13 * px, px);
      }
    },
    text(c, text, x, y, px) {
      c.save(); c.translate(x, y); c.scale(px, -px); c.font = FONT; c.textAlign = "center";
      c.lineWidth = 3; c.strokeStyle = "rgba(255,255,255,.85)"; c.strokeText(text, 0, 4);
      c.fillStyle = "#333"; c.fillText(text, 0, 4); c.restore();
    },
  },
};
