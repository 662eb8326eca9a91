// The camera: how the scene is framed, turned and followed, and what is under a place on the screen.
import { PerspectiveCamera, Raycaster, Vector2, Vector3, type Ray } from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { About } from "../protocol.ts";
import type { Layout } from "./layout.ts";

/** What is further from the middle of the picture than this share of half of it is followed. */
const CALM_SHARE = 0.55;
/** What moves out of the middle is caught up with in about this time, s. */
const FOLLOW_S = 0.25;
/** What leaves this share of half the picture is caught up with at once. */
const EDGE_SHARE = 0.9;
/** What is followed reaches no further than this share of half the picture. */
const ROOM_SHARE = 0.8;
/** The camera goes back at most this many times as far as it stood. */
const MOST_BACK = 40;

export class Eye {
  readonly camera = new PerspectiveCamera(35, 1, 0.01, 50);
  readonly controls: OrbitControls;
  follow = true;
  #layout: Layout | null = null;

  constructor(canvas: HTMLCanvasElement, onChange: () => void) {
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxPolarAngle = 0.495 * Math.PI;
    this.controls.addEventListener("change", onChange);
  }

  frame(layout: Layout, space: About["space"]): void {
    this.#layout = layout;
    this.#space = space;
    this.#radius = layout.radius;
    this.controls.minDistance = 0.5 * layout.radius;
    this.controls.maxDistance = 12 * layout.radius;
    this.camera.near = 0.05 * layout.radius;
    this.camera.far = 60 * layout.radius;
    this.reset();
  }
  #space: About["space"] = "space";
  #radius = 1;
  /** How many times as far back the camera stands as it was put. */
  #back = 1;

  /** From in front and above; what moves in a plane is seen from so high that no body hides the fingers behind it. */
  reset(): void {
    if (!this.#layout) return;
    const { centre, radius, aslant_rad } = this.#layout;
    this.#back = 1;
    // The scene's ball fits the narrower side.
    const half = Math.atan(Math.tan((this.camera.fov * Math.PI) / 360) * Math.min(1, this.camera.aspect));
    const distance = ((this.#space === "space" ? 0.9 : 0.87) * radius) / Math.sin(half);
    const [out, up] = this.#space === "plane" ? [0.38, 0.925] : this.#space === "line" ? [0.75, 0.66] : [0.84, 0.54];
    this.controls.target.set(...centre);
    const [aside, back] = [out * Math.sin(aslant_rad), out * Math.cos(aslant_rad)];
    this.camera.position.set(centre[0] - aside * distance, centre[1] - back * distance, centre[2] + up * distance);
    this.camera.updateProjectionMatrix();
    this.controls.update();
  }

  resize(width: number, height: number): void {
    const before = Math.min(1, this.camera.aspect);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    // What fitted goes on fitting.
    const factor = before / Math.min(1, this.camera.aspect);
    this.camera.position.sub(this.controls.target).multiplyScalar(factor).add(this.controls.target);
    this.controls.update();
  }

  /**
   * Moves along when what matters leaves the middle of the picture, and back when it needs more room; forward again, to
   * where it stood, when it no longer does. `spread` is how far what matters reaches from its middle, m. Says whether
   * it moved.
   */
  keep(middle: Vector3, spread: number, step_s: number): boolean {
    if (!this.follow || !Number.isFinite(spread) || !middle.toArray().every(Number.isFinite)) return false;
    const share = 1 - Math.exp(-step_s / FOLLOW_S);
    const moved = this.#stepBack(spread, share);
    const off = middle.clone().sub(this.controls.target);
    const half = this.#halfSeen();
    const excess = off.length() - CALM_SHARE * half;
    if (excess < 1e-4 * half) return moved;
    off.setLength(Math.max(share * excess, off.length() - EDGE_SHARE * half));
    this.controls.target.add(off);
    this.camera.position.add(off);
    this.controls.update();
    return true;
  }

  /** Half of the narrower side of what is seen where the camera looks, m. */
  #halfSeen(): number {
    const distance = this.camera.position.distanceTo(this.controls.target);
    return distance * Math.tan((this.camera.fov * Math.PI) / 360) * Math.min(1, this.camera.aspect);
  }

  /** Makes room for what reaches this far, m. */
  #stepBack(spread: number, share: number): boolean {
    const needed = spread / ROOM_SHARE / this.#halfSeen();
    const factor = Math.max(needed, 1 / this.#back);
    // Small differences are left alone, so that the picture is calm.
    if (factor < 1.02 && (factor > 0.98 || this.#back < 1.01)) return false;
    const step = Math.min(factor ** (factor > 2 ? 1 : share), MOST_BACK / this.#back);
    if (Math.abs(step - 1) < 1e-4) return false;
    this.#back *= step;
    this.camera.position.sub(this.controls.target).multiplyScalar(step).add(this.controls.target);
    this.controls.maxDistance = 12 * this.#radius * Math.max(1, this.#back);
    this.camera.far = 60 * this.#radius * Math.max(1, this.#back);
    this.camera.updateProjectionMatrix();
    this.controls.update();
    return true;
  }

  /** Turns around the scene, radians. */
  turn(around: number, over: number): void {
    const off = this.camera.position.clone().sub(this.controls.target);
    const distance = off.length();
    const azimuth = Math.atan2(off.y, off.x) + around;
    const height = Math.min(1.5, Math.max(0.03, Math.asin(off.z / distance) + over));
    off.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height));
    this.camera.position.copy(this.controls.target).addScaledVector(off, distance);
    this.controls.update();
  }

  zoom(factor: number): void {
    const off = this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor);
    off.clampLength(this.controls.minDistance, this.controls.maxDistance);
    this.camera.position.copy(this.controls.target).add(off);
    this.controls.update();
  }

  /** The way that a place on the screen looks; -1 to 1, up and right positive. */
  ray(x: number, y: number): Ray {
    const caster = new Raycaster();
    this.camera.updateMatrixWorld();
    caster.setFromCamera(new Vector2(x, y), this.camera);
    return caster.ray;
  }

  /** How large a pixel is at a place, m. */
  pixelAt(position: Vector3, height: number): number {
    const depth = position.clone().applyMatrix4(this.camera.matrixWorldInverse).z;
    return (2 * Math.abs(depth) * Math.tan((this.camera.fov * Math.PI) / 360)) / Math.max(1, height);
  }

  /** Where something is on the screen, -1 to 1; null behind the camera. */
  project(position: Vector3): Vector2 | null {
    const seen = position.clone().project(this.camera);
    return seen.z > 1 ? null : new Vector2(seen.x, seen.y);
  }
}
