// The picture: WebGL, cameras as RViz's views have them, labels, and drawing only what has changed. z is up, as in ROS.
// A picture is drawn when the one before is finished, so a slow (software) renderer delays pictures and not the page.
// If pictures take long, they get coarser.

import {
  Color,
  ColorManagement,
  DirectionalLight,
  LinearSRGBColorSpace,
  OrthographicCamera,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  WebGLRenderer,
} from "../../vendor/three/three.min.js";
import { t } from "../texts.js";
import { Labels } from "./labels.js";
import { yawOf } from "./transforms.js";

// Colors are those of messages, as they are on the screen; light is added to them as RViz does it.
ColorManagement.enabled = false;

const FIELD_OF_VIEW = (45 * Math.PI) / 180; // as in RViz
const MAX_PITCH = Math.PI / 2 - 0.001;
const SLOW_MS = 90;
const FAST_MS = 30;
const MAX_PICTURE_MS = 2000; // after which a picture counts as finished: a hidden tab may never see the end
const PARTIAL_PAUSE = 3; // while meshes load, pause this many times as long as the last picture took
const MAX_PAUSE_MS = 1000;
const MAX_RELEASED = 100; // materials
const RATIOS = [1, 0.75, 0.5];
const MAX_POINTS = { software: 150_000, hardware: 3_000_000 }; // of one cloud
const LEAST_POINTS = 20_000;
const SOFTWARE = /swiftshader|llvmpipe|software|softpipe|basic render/i;

export class Stage {
  constructor(frame) {
    this.canvas = document.createElement("canvas");
    this.canvas.className = "stage";
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("aria-label", t("The scene: drag to turn, with shift to move, wheel to zoom"));
    /** @type {{ antialias: boolean, alpha: boolean, powerPreference: "high-performance" }} */
    const options = { antialias: true, alpha: false, powerPreference: "high-performance" };
    const gl = /** @type {WebGL2RenderingContext} */ (this.canvas.getContext("webgl2", options));
    if (!gl)
      throw new Error(
        t("this browser has no WebGL 2; for chromium without a graphics card: --enable-unsafe-swiftshader"),
      );
    this.renderer = new WebGLRenderer({ canvas: this.canvas, context: gl, ...options });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    const about = gl.getExtension("WEBGL_debug_renderer_info");
    this.rendererName = String((about && gl.getParameter(about.UNMASKED_RENDERER_WEBGL)) ?? "");
    this.isSoftware = SOFTWARE.test(this.rendererName);
    this.gl = gl;
    this.mostPoints = MAX_POINTS[this.isSoftware ? "software" : "hardware"];

    this.frame = frame;
    this.scene = new Scene();
    this.perspective = new PerspectiveCamera((FIELD_OF_VIEW * 180) / Math.PI, 1, 0.02, 5000);
    this.flat = new OrthographicCamera(-1, 1, 1, -1, -2000, 2000);
    for (const camera of [this.perspective, this.flat]) camera.up.set(0, 0, 1);
    // As RViz's: from where the camera is, without any other. A surface that faces the camera has its own color.
    this.light = new DirectionalLight(0xffffff, Math.PI);
    this.scene.add(this.light, this.light.target);
    this.view = {
      kind: "orbit",
      distance: 10,
      focus: [0, 0, 0],
      pitch: 0.785,
      yaw: 0.785,
      scale: 50,
      angle: 0,
      target: "<Fixed Frame>",
    };
    this.base = { p: [0, 0, 0], yaw: 0 }; // of the target frame
    this.labels = new Labels();
    this.insets = new Set(); // other cameras' views: {canvas, texture, background, aim(), show()}
    this.corner = document.createElement("div");
    this.corner.className = "insets";
    frame.append(this.canvas, this.labels.element, this.corner);

    this.isStale = true;
    this.isCleared = true; // whether the canvas is empty
    this.loads = 0; // meshes and textures that are on their way
    this.released = []; // materials that are disposed of after the next picture
    this.fence = null;
    this.drawn = 0;
    this.started = 0;
    this.milliseconds = 0; // of a picture, from its commands to its end
    this.ratio = 0;
    this.coarser = 0; // pictures that were too slow, less those that were not
    this.onTick = () => {};
    this.onAim = (_camera) => {}; // before each picture, with its camera
    this.onView = () => {};
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(frame);
    this.resize();
    this.tick = this.tick.bind(this);
    this.request = requestAnimationFrame(this.tick);
    this.canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.canvas.addEventListener("webglcontextrestored", () => this.invalidate());
  }

  close() {
    cancelAnimationFrame(this.request);
    this.observer.disconnect();
    this.disposeReleased();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.canvas.remove();
    this.labels.element.remove();
    this.corner.remove();
  }

  get camera() {
    return this.view.kind === "top" ? this.flat : this.perspective;
  }

  /**
   * Return how many pixels (of the screen, not of the drawing) a metre has at a distance of 1, or everywhere in a flat
   * view.
   */
  get pixelsPerMetre() {
    return this.view.kind === "top" ? this.view.scale : this.height / (2 * Math.tan(FIELD_OF_VIEW / 2));
  }

  set background(rgb) {
    this.scene.background = new Color(...rgb.map((part) => part / 255));
    this.invalidate();
  }

  invalidate() {
    this.isStale = true;
    this.showSettled();
  }

  /** Run an async function that loads a mesh or a texture, then redraw, even if it fails. */
  async load(work) {
    this.loads += 1;
    this.showSettled();
    try {
      return await work();
    } finally {
      this.loads -= 1;
      this.invalidate();
    }
  }

  /**
   * Dispose of a material after the next picture: a program that no material uses is deleted, and would be compiled
   * again for the next message. A hidden tab draws no picture, so dispose of it at once.
   */
  release(material) {
    this.released.push(material);
    if (document.hidden || this.released.length > MAX_RELEASED) this.disposeReleased();
  }

  disposeReleased() {
    for (const material of this.released.splice(0)) material.dispose();
  }

  /** Return whether to postpone drawing: while meshes load, slow pictures of a part of the scene delay the rest. */
  isEarly() {
    const pause = Math.min(PARTIAL_PAUSE * this.milliseconds, MAX_PAUSE_MS);
    return this.loads > 0 && !this.isCleared && performance.now() - this.started < this.milliseconds + pause;
  }

  resize() {
    this.width = Math.max(1, this.frame.clientWidth);
    this.height = Math.max(1, this.frame.clientHeight);
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, this.isSoftware ? 1 : 2) * RATIOS[this.ratio]);
    this.renderer.setSize(this.width, this.height);
    this.isCleared = true;
    this.invalidate();
  }

  // --- drawing

  tick() {
    this.request = requestAnimationFrame(this.tick);
    if (!this.isFinished()) return;
    this.onTick();
    if (this.isStale && !this.isEarly()) this.draw();
    this.showSettled();
  }

  /** Let the page's tests see when the picture is complete. */
  showSettled() {
    const isSettled = String(!this.isStale && !this.loads && !this.fence);
    if (this.canvas.dataset.settled !== isSettled) this.canvas.dataset.settled = isSettled;
  }

  draw() {
    this.isStale = this.isCleared = false;
    this.aim();
    this.onAim(this.camera);
    this.started = performance.now();
    for (const inset of this.insets) this.drawInset(inset);
    this.renderer.render(this.scene, this.camera);
    this.fence = this.gl.fenceSync(this.gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    this.gl.flush();
    this.disposeReleased();
    this.labels.draw(this);
    this.drawn += 1;
    this.canvas.dataset.drawn = String(this.drawn);
  }

  addInset(inset) {
    this.insets.add(inset);
    this.corner.append(inset.canvas);
  }

  removeInset(inset) {
    this.insets.delete(inset);
    inset.canvas.remove();
  }

  /** Draw the scene as another camera sees it into a corner of the canvas, from where its view is copied. */
  drawInset(inset) {
    const camera = inset.aim();
    inset.canvas.hidden = !camera;
    if (!camera) return;
    const { renderer, scene } = this;
    const { width: across, height: along } = inset.texture.image;
    const isLarge = inset.canvas.classList.contains("large");
    const width = Math.min(
      this.width * (isLarge ? 0.9 : 0.34),
      (this.height * (isLarge ? 0.85 : 0.4) * across) / along,
    );
    const height = (width * along) / across;
    const { background } = scene;
    scene.background = inset.background ?? background;
    this.lightFrom(camera);
    renderer.setViewport(0, 0, width, height);
    renderer.setScissor(0, 0, width, height);
    renderer.setScissorTest(true);
    renderer.render(scene, camera);
    renderer.setScissorTest(false);
    renderer.setViewport(0, 0, this.width, this.height);
    scene.background = background;
    this.lightFrom(this.camera);

    const ratio = renderer.getPixelRatio();
    const [x, y] = [width, height].map((size) => Math.max(1, Math.floor(size * ratio)));
    inset.show(this.canvas, 0, this.canvas.height - y, x, y);
    inset.canvas.style.width = `${width}px`;
  }

  isFinished() {
    if (!this.fence) return true;
    const state = this.gl.clientWaitSync(this.fence, 0, 0);
    if (state === this.gl.TIMEOUT_EXPIRED && performance.now() - this.started < MAX_PICTURE_MS) return false;
    this.gl.deleteSync(this.fence);
    this.fence = null;
    this.milliseconds = Math.min(performance.now() - this.started, MAX_PICTURE_MS);
    this.adapt();
    return true;
  }

  /** Draw fewer pixels where pictures take long, then fewer points; and again more pixels if they do not. */
  adapt() {
    if (this.milliseconds > SLOW_MS) this.coarser += 1;
    else if (this.milliseconds < FAST_MS) this.coarser -= 0.25;
    this.coarser = Math.max(-40, Math.min(this.coarser, 8));
    const before = this.ratio;
    if (this.coarser >= 8 && this.ratio < RATIOS.length - 1) this.ratio += 1;
    else if (this.coarser >= 8) this.mostPoints = Math.max(LEAST_POINTS, Math.round(this.mostPoints / 2));
    else if (this.coarser <= -40 && this.ratio > 0) this.ratio -= 1;
    else return;
    this.coarser = 0;
    // Resizing clears the canvas, so resize only if the ratio has changed.
    if (this.ratio !== before) this.resize();
  }

  // --- the view

  /** Change parts of the view. */
  setView(parts) {
    Object.assign(this.view, parts);
    this.view.pitch = Math.min(MAX_PITCH, Math.max(-MAX_PITCH, this.view.pitch));
    this.invalidate();
    this.onView();
  }

  /** Put the view's origin to a frame, which it follows: {p, q} in the fixed frame. */
  setBase({ p, q }) {
    const yaw = this.view.kind === "follow" ? yawOf(q) : 0;
    const before = this.base;
    if (Math.abs(before.yaw - yaw) < 1e-6 && p.every((part, index) => Math.abs(part - before.p[index]) < 1e-6)) return;
    this.base = { p, yaw };
    this.invalidate();
  }

  /** Return the focal point in the fixed frame. */
  focalPoint() {
    const { p, yaw } = this.base;
    const [x, y, z] = this.view.focus;
    return new Vector3(
      p[0] + x * Math.cos(yaw) - y * Math.sin(yaw),
      p[1] + x * Math.sin(yaw) + y * Math.cos(yaw),
      p[2] + z,
    );
  }

  aim() {
    const { kind, distance, pitch, scale, angle } = this.view;
    const focus = this.focalPoint();
    const { camera } = this;
    if (kind === "top") {
      const [halfWidth, halfHeight] = [this.width / scale / 2, this.height / scale / 2];
      Object.assign(camera, { left: -halfWidth, right: halfWidth, top: halfHeight, bottom: -halfHeight });
      camera.up.set(-Math.sin(angle), Math.cos(angle), 0);
      camera.position.set(focus.x, focus.y, 500);
      camera.lookAt(focus.x, focus.y, 0);
    } else {
      const yaw = this.view.yaw + this.base.yaw;
      const away = new Vector3(Math.cos(yaw) * Math.cos(pitch), Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch));
      camera.position.copy(focus).addScaledVector(away, distance);
      camera.lookAt(focus);
      this.perspective.aspect = this.width / this.height;
      camera.near = Math.max(0.005, distance / 500);
      camera.far = Math.max(1000, distance * 50);
    }
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    this.lightFrom(camera);
  }

  lightFrom(camera) {
    this.light.position.copy(camera.position);
    this.light.target.position.copy(camera.position).add(camera.getWorldDirection(new Vector3()));
  }

  /** Move the focal point by pixels of the screen. */
  pan(dx, dy) {
    this.aim();
    const metres = this.view.kind === "top" ? 1 / this.view.scale : this.view.distance / this.pixelsPerMetre;
    const right = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 0);
    const up = new Vector3().setFromMatrixColumn(this.camera.matrixWorld, 1);
    const way = right.multiplyScalar(-dx * metres).addScaledVector(up, dy * metres);
    way.applyAxisAngle(new Vector3(0, 0, 1), -this.base.yaw);
    const [x, y, z] = this.view.focus;
    this.setView({ focus: [x + way.x, y + way.y, this.view.kind === "top" ? 0 : z + way.z] });
  }

  /** Zoom in (factor above 1) or out; a flat view keeps what is at this place of the screen. */
  zoom(factor, x = null, y = null) {
    if (this.view.kind !== "top") {
      this.setView({ distance: Math.min(4000, Math.max(0.02, this.view.distance / factor)) });
      return;
    }
    const before = x === null ? null : this.ground(x, y);
    this.setView({ scale: Math.min(20_000, Math.max(0.05, this.view.scale * factor)) });
    const after = before && this.ground(x, y);
    if (after)
      this.setView({ focus: [this.view.focus[0] + before.x - after.x, this.view.focus[1] + before.y - after.y, 0] });
  }

  rotate(dx, dy) {
    if (this.view.kind === "top") this.setView({ angle: this.view.angle + dx * 0.005 });
    else this.setView({ yaw: this.view.yaw - dx * 0.008, pitch: this.view.pitch + dy * 0.008 });
  }

  // --- what is under the mouse; x and y are pixels of the canvas

  ray(x, y) {
    this.aim();
    const caster = new Raycaster();
    caster.setFromCamera(new Vector2((x / this.width) * 2 - 1, 1 - (y / this.height) * 2), this.camera);
    return caster;
  }

  /** Return the point of the ground (z = 0 of the fixed frame) there, null above the horizon. */
  ground(x, y) {
    const { origin, direction } = this.ray(x, y).ray;
    if (Math.abs(direction.z) < 1e-9) return null;
    const far = -origin.z / direction.z;
    return far > 0 ? origin.clone().addScaledVector(direction, far) : null;
  }

  /** Return what the ray there meets of objects, the nearest first. */
  hits(x, y, objects) {
    const caster = this.ray(x, y);
    const isFlat = this.view.kind === "top";
    caster.params.Points.threshold = (isFlat ? 1 : this.view.distance) * (5 / this.pixelsPerMetre);
    caster.params.Line2 = { threshold: 4 };
    return caster.intersectObjects(objects, true).filter(({ object }) => object.visible && !object.userData.isUnpicked);
  }

  /** Return the point of an object there, else of the ground; null for neither. */
  pick(x, y, objects) {
    const hits = this.hits(x, y, objects);
    // Of points the one next to the ray, not the first that the threshold lets through.
    const solid = hits.find(({ distanceToRay }) => distanceToRay === undefined);
    const dots = hits.filter(
      ({ distanceToRay, distance }) => distanceToRay !== undefined && distance < (solid?.distance ?? Infinity) + 1e-3,
    );
    if (dots.length) {
      /** @type {any} */
      const best = dots.reduce((one, other) => (other.distanceToRay < one.distanceToRay ? other : one));
      return best.object.localToWorld(
        new Vector3().fromBufferAttribute(best.object.geometry.attributes.position, best.index),
      );
    }
    return solid?.point ?? this.ground(x, y);
  }
}
