// Rigid bodies: one solid, and every host's copy as a translucent ghost with an outline in its user's colour.
import {
  Color, EdgesGeometry, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshStandardMaterial, Quaternion,
  Vector3, type BufferGeometry, type Object3D,
} from "three";
import type { BodyPose, Picture } from "../picture.ts";
import type { About, BodyInfo, HostIndex } from "../protocol.ts";
import { type Colours, userColour } from "./colours.ts";
import { bodyGeometry, outlineSource } from "./shapes.ts";

/** Edges of a ghost are those where faces meet at more than this angle. */
const EDGE_DEGREES = 25;

export class Bodies {
  readonly group = new Group();
  /** How far copies are drawn from their mean, as a multiple of how far they are; 0: no copies. */
  apart = 1;
  #solids: Solid[];
  #ghosts: Ghost[][];

  constructor(about: About, colours: Colours) {
    this.#solids = about.bodies.map((body) => new Solid(body));
    this.#ghosts = about.bodies.map((body) => about.users.map(() => new Ghost(body)));
    this.#solids.forEach((solid) => this.group.add(solid.mesh));
    this.#ghosts.flat().forEach((ghost) => this.group.add(ghost.group));
    this.colour(colours);
  }

  /** With a `mine`, the solid is the copy that this user feels; else it is where the copies are on average. */
  show(picture: Picture, mine: HostIndex | null): void {
    this.#solids.forEach((solid, body) => {
      const copies = picture.hosts.flatMap((host) => host.bodies[body] ?? []);
      const mean = meanPose(copies);
      const own = picture.hosts.find((host) => host.host === mine)?.bodies[body];
      solid.mesh.visible = copies.length > 0;
      place(solid.mesh, own ?? mean);
      this.#ghosts[body]?.forEach((ghost, user) => {
        const pose = picture.hosts.find((host) => host.host === user)?.bodies[body];
        ghost.group.visible = this.apart > 0 && copies.length > 1 && pose !== undefined;
        if (pose) place(ghost.group, exaggerated(pose, mean, this.apart));
      });
    });
  }

  colour(colours: Colours): void {
    this.#solids.forEach((solid) => solid.colour(colours));
    this.#ghosts.forEach((ghosts) => ghosts.forEach((ghost, user) => ghost.colour(userColour(colours, user))));
  }

  dispose(): void {
    this.#solids.forEach((solid) => solid.dispose());
    this.#ghosts.flat().forEach((ghost) => ghost.dispose());
  }
}

export function meanPose(poses: BodyPose[]): BodyPose {
  const position = new Vector3();
  const sum: [number, number, number, number] = [0, 0, 0, 0];
  for (const { position_m, orientation_xyzw } of poses) {
    position.addScaledVector(new Vector3(...position_m), 1 / poses.length);
    // Both signs are the same orientation.
    const sign = orientation_xyzw.reduce((dot, part, i) => dot + part * (sum[i] ?? 0), 0) < 0 ? -1 : 1;
    orientation_xyzw.forEach((part, i) => { sum[i] = (sum[i] ?? 0) + sign * part; });
  }
  const orientation = new Quaternion(...sum);
  if (orientation.lengthSq() < 1e-12) orientation.identity();
  orientation.normalize();
  const { x, y, z, w } = orientation;
  return { position_m: position.toArray(), orientation_xyzw: [x, y, z, w] };
}

/** `pose`, `apart` times as far from `mean` as it is; turned as it is. */
export function exaggerated(pose: BodyPose, mean: BodyPose, apart: number): BodyPose {
  const away = (value: number, axis: number) => {
    const middle = mean.position_m[axis] ?? 0;
    return middle + apart * (value - middle);
  };
  const [x, y, z] = pose.position_m;
  return { position_m: [away(x, 0), away(y, 1), away(z, 2)], orientation_xyzw: pose.orientation_xyzw };
}

function place(object: Object3D, pose: BodyPose): void {
  object.position.set(...pose.position_m);
  object.quaternion.set(...pose.orientation_xyzw).normalize();
}

class Solid {
  readonly mesh: Mesh<BufferGeometry, MeshStandardMaterial>;
  #fixed: boolean;

  constructor(body: BodyInfo) {
    this.#fixed = body.fixed;
    this.mesh = new Mesh(bodyGeometry(body), new MeshStandardMaterial({ roughness: 0.55, metalness: 0 }));
    this.mesh.castShadow = true;
    this.mesh.receiveShadow = true;
  }

  colour(colours: Colours): void {
    const share = this.#fixed ? 0.75 : 0.5;
    const plain = colours.dark ? new Color("#b3a58f") : new Color("#e9dcc3");
    this.mesh.material.color.copy(plain).lerp(colours.muted, share - 0.5);
  }

  dispose(): void {
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

class Ghost {
  readonly group = new Group();
  #fill: Mesh<BufferGeometry, MeshBasicMaterial>;
  #outline: LineSegments<EdgesGeometry, LineBasicMaterial>;

  constructor(body: BodyInfo) {
    const shape = outlineSource(body);
    // A little behind, so that it shows where it sticks out of the solid and not where their faces coincide.
    const behind = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 };
    const glass = { transparent: true, opacity: 0.16, depthWrite: false, ...behind };
    this.#fill = new Mesh(shape, new MeshBasicMaterial(glass));
    const edges = new EdgesGeometry(shape, EDGE_DEGREES);
    this.#outline = new LineSegments(edges, new LineBasicMaterial({ transparent: true }));
    // Lines lie in the faces that they bound: they are drawn last and seen through what is in front.
    this.#outline.renderOrder = 2;
    this.#outline.material.depthTest = false;
    this.#outline.material.opacity = 0.85;
    this.group.add(this.#fill, this.#outline);
  }

  colour(colour: Color): void {
    this.#fill.material.color.copy(colour);
    this.#outline.material.color.copy(colour);
  }

  dispose(): void {
    this.#fill.geometry.dispose();
    this.#outline.geometry.dispose();
    this.#fill.material.dispose();
    this.#outline.material.dispose();
  }
}
