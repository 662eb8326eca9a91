// The small things that a hand is drawn with. Each has an `object` to add, a `show` and a `dispose`.
import {
  BackSide, BufferGeometry, Color, ConeGeometry, Curve, CylinderGeometry, GreaterDepth, Group, Mesh, MeshBasicMaterial,
  MeshStandardMaterial, Quaternion, SphereGeometry, TorusGeometry, TubeGeometry, Vector3, type Material,
} from "three";
import type { Phase } from "../picture.ts";
import type { Colours } from "./colours.ts";

const ALONG = new Vector3(0, 1, 0);

/** Turns and stretches an object that is one metre long along y so that it goes from one point to another. */
function span(object: Group | Mesh, from: Vector3, to: Vector3): void {
  const way = to.clone().sub(from);
  const length = way.length();
  object.position.copy(from);
  object.quaternion.setFromUnitVectors(ALONG, length > 1e-9 ? way.divideScalar(length) : ALONG);
  object.scale.set(1, Math.max(length, 1e-6), 1);
}

function disposeOf(...meshes: Mesh<BufferGeometry, Material>[]): void {
  for (const mesh of meshes) {
    mesh.geometry.dispose();
    mesh.material.dispose();
  }
}

/** A finger; where a body hides it, it shines through. */
export class Ball {
  readonly mesh: Mesh<BufferGeometry, MeshStandardMaterial>;
  readonly object: Mesh;
  #hidden: Mesh<BufferGeometry, MeshBasicMaterial>;
  constructor(radius: number) {
    this.mesh = new Mesh(new SphereGeometry(radius, 32, 20), new MeshStandardMaterial({ roughness: 0.35 }));
    this.mesh.castShadow = true;
    const through = { depthFunc: GreaterDepth, depthWrite: false, transparent: true, opacity: 0.45 };
    this.#hidden = new Mesh(this.mesh.geometry, new MeshBasicMaterial(through));
    this.#hidden.renderOrder = 1;
    this.mesh.add(this.#hidden);
    this.object = this.mesh;
  }
  show(at: Vector3): void { this.mesh.position.copy(at); }
  colour(colour: Color): void {
    this.mesh.material.color.copy(colour);
    this.#hidden.material.color.copy(colour);
  }
  dispose(): void { disposeOf(this.mesh, this.#hidden); }
}

/** What a finger does at a surface, as an outline around it. */
export class Halo {
  readonly object: Mesh<BufferGeometry, MeshBasicMaterial>;
  #phase: Phase = "free";
  #colours: Colours | null = null;
  constructor(radius: number) {
    this.object = new Mesh(new SphereGeometry(1.3 * radius, 32, 20), new MeshBasicMaterial({ side: BackSide }));
  }
  show(at: Vector3, phase: Phase): void {
    this.object.position.copy(at);
    this.object.visible = phase !== "free";
    if (phase !== this.#phase) {
      this.#phase = phase;
      this.#paint();
    }
  }
  colours(colours: Colours): void {
    this.#colours = colours;
    this.#paint();
  }
  #paint(): void {
    if (this.#colours) this.object.material.color.copy(phaseColour(this.#colours, this.#phase));
  }
  dispose(): void { disposeOf(this.object); }
}

export function phaseColour(colours: Colours, phase: Phase): Color {
  switch (phase) {
    case "moment-cancellation": return colours.warning;
    case "pre-slide": return colours.good;
    case "slide": return colours.bad;
    default: return colours.muted;
  }
}

/** Where a finger is held on a surface: a dot, and a ring around it that lies in the surface. */
export class Proxy {
  readonly object = new Group();
  #dot: Mesh<BufferGeometry, MeshBasicMaterial>;
  #ring: Mesh<BufferGeometry, MeshBasicMaterial>;
  constructor(radius: number) {
    const seen = { depthTest: false, transparent: true };
    this.#dot = new Mesh(new SphereGeometry(0.4 * radius, 12, 8), new MeshBasicMaterial(seen));
    const ring = new TorusGeometry(radius, 0.14 * radius, 8, 32);
    this.#ring = new Mesh(ring, new MeshBasicMaterial({ ...seen, opacity: 0.8 }));
    this.#ring.rotateX(Math.PI / 2);
    this.object.add(this.#dot, this.#ring);
    this.object.renderOrder = 3;
  }
  show(at: Vector3 | null, force: Vector3): void {
    this.object.visible = at !== null;
    if (!at) return;
    this.object.position.copy(at);
    if (force.lengthSq() > 1e-12) this.object.quaternion.setFromUnitVectors(ALONG, force.clone().normalize());
  }
  colour(colour: Color): void {
    this.#dot.material.color.copy(colour);
    this.#ring.material.color.copy(colour);
  }
  dispose(): void { disposeOf(this.#dot, this.#ring); }
}

/** A force. */
export class Arrow {
  readonly object = new Group();
  #shaft: Mesh<BufferGeometry, MeshStandardMaterial>;
  #head: Mesh<BufferGeometry, MeshStandardMaterial>;
  #headLength: number;
  constructor(radius: number) {
    const material = () => new MeshStandardMaterial({ roughness: 0.6 });
    this.#shaft = new Mesh(new CylinderGeometry(radius, radius, 1, 16).translate(0, 0.5, 0), material());
    this.#headLength = 6 * radius;
    const cone = new ConeGeometry(2.4 * radius, this.#headLength, 20).translate(0, this.#headLength / 2, 0);
    this.#head = new Mesh(cone, material());
    this.#shaft.castShadow = true;
    this.#head.castShadow = true;
    this.object.add(this.#shaft, this.#head);
  }
  /** `way` in metres, as it is drawn. */
  show(from: Vector3, way: Vector3 | null): void {
    this.object.visible = way !== null;
    if (!way) return;
    const length = way.length();
    const head = Math.min(this.#headLength, 0.5 * length);
    const neck = from.clone().addScaledVector(way, (length - head) / length);
    span(this.#shaft, from, neck);
    this.#head.position.copy(neck);
    this.#head.quaternion.copy(this.#shaft.quaternion);
    this.#head.scale.setScalar(head / this.#headLength);
  }
  colour(colour: Color): void {
    this.#shaft.material.color.copy(colour);
    this.#head.material.color.copy(colour);
  }
  dispose(): void { disposeOf(this.#shaft, this.#head); }
}

class Coil extends Curve<Vector3> {
  constructor(private radius: number, private turns: number) { super(); }
  override getPoint(t: number, point = new Vector3()): Vector3 {
    const angle = 2 * Math.PI * this.turns * t;
    // Its ends are on the axis.
    const radius = this.radius * Math.min(1, 10 * t, 10 * (1 - t));
    return point.set(radius * Math.cos(angle), t, radius * Math.sin(angle));
  }
}

/** A coil between two points; the more it is stretched, the more it has of its second colour. */
export class Spring {
  readonly object: Mesh<BufferGeometry, MeshStandardMaterial>;
  #slack = new Color();
  #taut = new Color();
  #share = 0;
  constructor(radius: number, turns: number) {
    const tube = new TubeGeometry(new Coil(radius, turns), 12 * turns, 0.28 * radius, 6);
    // Only the axis is stretched; the normals of a unit coil would be far off.
    tube.computeVertexNormals();
    this.object = new Mesh(tube, new MeshStandardMaterial({ roughness: 0.5 }));
  }
  show(from: Vector3, to: Vector3 | null, share: number): void {
    this.object.visible = to !== null;
    if (!to) return;
    span(this.object, from, to);
    this.#share = Math.min(1, share);
    this.#paint();
  }
  colours(slack: Color, taut: Color): void {
    this.#slack.copy(slack);
    this.#taut.copy(taut);
    this.#paint();
  }
  #paint(): void {
    this.object.material.color.copy(this.#slack).lerp(this.#taut, this.#share);
  }
  dispose(): void { disposeOf(this.object); }
}

/** Where the pointer is: a ring that always faces the reader. */
export class Ring {
  readonly object: Mesh<BufferGeometry, MeshBasicMaterial>;
  constructor(radius: number) {
    const material = new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.9 });
    this.object = new Mesh(new TorusGeometry(radius, 0.06 * radius, 8, 40), material);
    this.object.renderOrder = 4;
  }
  show(at: Vector3 | null): void {
    this.object.visible = at !== null;
    if (at) this.object.position.copy(at);
  }
  face(towards: Quaternion): void { this.object.quaternion.copy(towards); }
  colour(colour: Color): void { this.object.material.color.copy(colour); }
  dispose(): void { disposeOf(this.object); }
}

/** The way that a hand on a line can go. */
export class Rail {
  readonly object: Mesh<BufferGeometry, MeshBasicMaterial>;
  constructor(centre: Vector3, length: number, radius: number) {
    const along = new CylinderGeometry(radius, radius, length, 8).rotateZ(Math.PI / 2);
    this.object = new Mesh(along, new MeshBasicMaterial());
    this.object.position.copy(centre);
  }
  colour(colour: Color): void { this.object.material.color.copy(colour); }
  dispose(): void { disposeOf(this.object); }
}
