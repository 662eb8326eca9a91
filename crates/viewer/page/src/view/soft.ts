// The soft object: one copy solid, coloured by how far it is from rest or by its stress; the others, if wanted, as nets in
// their users' colours.
import {
  Color, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshStandardMaterial, type BufferGeometry,
} from "three";
import type { Picture, SurfacePicture } from "../picture.ts";
import type { About, HostIndex, SoftInfo } from "../protocol.ts";
import { ColourScale, TABLE } from "./colourmap.ts";
import { type Colours, userColour } from "./colours.ts";
import { Skin, Weave } from "./skin.ts";

/** What a soft object's colours say. */
export type Shown = "displacement" | "stress" | "plain";

/** Scales are at least so long: what is less is not worth colours, m and Pa. */
const LEAST = { displacement: 0.001, stress: 100 };

export class SoftObject {
  readonly group = new Group();
  /** What the solid's colours say, and on which scale. */
  shown: Shown = "displacement";
  readonly scales = { displacement: new ColourScale(LEAST.displacement), stress: new ColourScale(LEAST.stress) };
  /** Whether other hosts' copies are drawn. */
  copies = false;
  #solid: Solid;
  #nets: Net[];

  constructor(soft: SoftInfo, about: About, colours: Colours) {
    const weave = new Weave(soft);
    this.#solid = new Solid(weave);
    this.#nets = about.users.map(() => new Net(weave));
    this.group.add(this.#solid.group, ...this.#nets.map((net) => net.group));
    this.colour(colours);
  }

  /** With a `mine`, the solid is the copy that this user feels. */
  show(picture: Picture, mine: HostIndex | null): void {
    const own = ownSurface(picture, mine);
    this.#solid.skin.update(own);
    const { displacement_m, stress_pa } = this.#solid.skin;
    this.scales.displacement.follow(largest(displacement_m), picture.time_s);
    this.scales.stress.follow(largest(stress_pa), picture.time_s);
    this.#paint();
    this.#nets.forEach((net, user) => {
      const surface = picture.surfaces.find((one) => one.host === user);
      net.group.visible = this.copies && surface !== undefined && surface !== own;
      if (net.group.visible && surface) net.skin.update(surface);
    });
  }

  colour(colours: Colours): void {
    this.#solid.colour(colours);
    this.#nets.forEach((net, user) => net.colour(userColour(colours, user)));
    this.#paint();
  }

  dispose(): void {
    this.#solid.dispose();
    this.#nets.forEach((net) => net.dispose());
  }

  #paint(): void {
    const { skin, plain } = this.#solid;
    if (this.shown === "plain") {
      skin.paint((_, into, at) => { plain.toArray(into, at); });
      return;
    }
    const values = this.shown === "stress" ? skin.stress_pa : skin.displacement_m;
    const steps = (TABLE.length / 3 - 1) / this.scales[this.shown].limit;
    skin.paint((vertex, into, at) => {
      const place = 3 * Math.min(TABLE.length / 3 - 1, Math.round(steps * (values[vertex] ?? 0)));
      for (let part = 0; part < 3; part++) into[at + part] = TABLE[place + part] ?? 0;
    });
  }
}

/** The surface that `mine` feels, else any host's; null where there is none. */
export function ownSurface(picture: Picture, mine: HostIndex | null): SurfacePicture | null {
  return picture.surfaces.find((surface) => surface.host === mine) ?? picture.surfaces[0] ?? null;
}

function largest(values: Float32Array): number {
  return values.reduce((most, value) => Math.max(most, value), 0);
}

class Solid {
  readonly group = new Group();
  readonly skin: Skin;
  readonly plain = new Color();
  #mesh: Mesh<BufferGeometry, MeshStandardMaterial>;
  #lines: LineSegments<BufferGeometry, LineBasicMaterial>;

  constructor(weave: Weave) {
    this.skin = new Skin(weave);
    // An open surface has no inside that would hide its back.
    const behind = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    const material = new MeshStandardMaterial({ vertexColors: true, roughness: 0.65, side: DoubleSide, ...behind });
    this.#mesh = new Mesh(this.skin.geometry, material);
    this.#mesh.castShadow = true;
    this.#mesh.receiveShadow = true;
    this.#lines = new LineSegments(this.skin.lines, new LineBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false }));
    this.group.add(this.#mesh, this.#lines);
  }

  colour(colours: Colours): void {
    this.plain.set(colours.dark ? "#b3a58f" : "#e9dcc3");
    // The surface is light or dark by itself, whatever the page is.
    this.#lines.material.color.set("#000000");
  }

  dispose(): void {
    this.skin.dispose();
    this.#mesh.material.dispose();
    this.#lines.material.dispose();
  }
}

class Net {
  readonly group = new Group();
  readonly skin: Skin;
  #fill: Mesh<BufferGeometry, MeshBasicMaterial>;
  #lines: LineSegments<BufferGeometry, LineBasicMaterial>;

  constructor(weave: Weave) {
    this.skin = new Skin(weave);
    // A little behind, so that it shows where it sticks out of the solid and not where the two coincide.
    const behind = { polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 };
    const glass = { transparent: true, opacity: 0.14, depthWrite: false, side: DoubleSide, ...behind };
    this.#fill = new Mesh(this.skin.geometry, new MeshBasicMaterial(glass));
    this.#lines = new LineSegments(this.skin.lines, new LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    this.#lines.renderOrder = 2;
    this.group.visible = false;
    this.group.add(this.#fill, this.#lines);
  }

  colour(colour: Color): void {
    this.#fill.material.color.copy(colour);
    this.#lines.material.color.copy(colour);
  }

  dispose(): void {
    this.skin.dispose();
    this.#fill.material.dispose();
    this.#lines.material.dispose();
  }
}
