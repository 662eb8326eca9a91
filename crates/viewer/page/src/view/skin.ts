// The surface of a soft object as triangles whose vertices move.
import { BufferAttribute, BufferGeometry, Vector3 } from "three";
import type { SurfacePicture } from "../picture.ts";
import type { SoftInfo } from "../protocol.ts";

/** Faces that meet at more than this angle, at rest, are lit as if they were apart. */
const CREASE_DEGREES = 50;

/** What does not move: shared by all copies of the object. */
export class Weave {
  readonly rest_m: Float32Array;
  /** Which of the object's vertices each vertex that is drawn is: those on creases are drawn several times. */
  readonly source: number[] = [];
  /** Three vertices that are drawn each. */
  readonly triangles: number[];
  /** Two vertices that are drawn each: every edge once. */
  readonly edges: number[];

  constructor({ surface }: SoftInfo) {
    this.rest_m = Float32Array.from(surface.vertices_m);
    this.triangles = this.#unfold(surface.triangles);
    this.edges = this.#edgesOf(this.triangles);
  }

  /** Vertices of the object. */
  get count(): number { return this.rest_m.length / 3; }

  #unfold(triangles: number[]): number[] {
    const smooth = Math.cos((CREASE_DEGREES * Math.PI) / 180);
    const copies = new Map<number, { vertex: number; normal: Vector3 }[]>();
    return triangles.map((from, corner) => {
      const normal = this.#normalOf(triangles, corner - (corner % 3));
      const known = copies.get(from) ?? [];
      copies.set(from, known);
      let copy = known.find((one) => one.normal.dot(normal) >= smooth);
      if (!copy) known.push(copy = { vertex: this.source.push(from) - 1, normal });
      return copy.vertex;
    });
  }

  #normalOf(triangles: number[], first: number): Vector3 {
    const [a, b, c] = [0, 1, 2].map((corner) => new Vector3().fromArray(this.rest_m, 3 * (triangles[first + corner] ?? 0))) as
      [Vector3, Vector3, Vector3];
    return b.sub(a).cross(c.sub(a)).normalize();
  }

  #edgesOf(triangles: number[]): number[] {
    const edges = new Map<string, [number, number]>();
    triangles.forEach((from, corner) => {
      const to = triangles[corner % 3 === 2 ? corner - 2 : corner + 1] ?? from;
      const ends = [this.source[from] ?? 0, this.source[to] ?? 0].sort((one, other) => one - other);
      if (!edges.has(ends.join())) edges.set(ends.join(), [from, to]);
    });
    return [...edges.values()].flat();
  }
}

/** One copy of the object: its triangles and edges where they are, in the world frame. */
export class Skin {
  readonly geometry = new BufferGeometry();
  readonly lines = new BufferGeometry();
  /** How far each of the object's vertices is from where it rests, m; and its stress, Pa. */
  readonly displacement_m: Float32Array;
  readonly stress_pa: Float32Array;
  #positions: BufferAttribute;
  #colours: BufferAttribute;

  constructor(private weave: Weave) {
    const drawn = weave.source.length;
    this.displacement_m = new Float32Array(weave.count);
    this.stress_pa = new Float32Array(weave.count);
    this.#positions = new BufferAttribute(new Float32Array(3 * drawn), 3);
    this.#colours = new BufferAttribute(new Float32Array(3 * drawn).fill(1), 3);
    this.geometry.setAttribute("position", this.#positions);
    this.geometry.setAttribute("color", this.#colours);
    this.geometry.setIndex(weave.triangles);
    this.lines.setAttribute("position", this.#positions);
    this.lines.setIndex(weave.edges);
    this.update(null);
  }

  /** With no surface, at rest. False, and as it was, where the surface is of another object. */
  update(surface: SurfacePicture | null): boolean {
    const { rest_m, source, count } = this.weave;
    if (surface && surface.packed.length !== 4 * count) return false;
    const [packed, step_m, step_pa] = [surface?.packed, surface?.step_m ?? 0, surface?.step_pa ?? 0];
    for (let vertex = 0; vertex < count; vertex++) {
      const at = 4 * vertex;
      const [x = 0, y = 0, z = 0, stress = 0] = packed ? [packed[at], packed[at + 1], packed[at + 2], packed[at + 3]] : [];
      this.displacement_m[vertex] = step_m * Math.hypot(x, y, z);
      this.stress_pa[vertex] = step_pa * (stress & 0xffff);
    }
    const positions = this.#positions.array;
    source.forEach((vertex, drawn) => {
      for (let axis = 0; axis < 3; axis++) {
        positions[3 * drawn + axis] = (rest_m[3 * vertex + axis] ?? 0) + step_m * (packed?.[4 * vertex + axis] ?? 0);
      }
    });
    this.#positions.needsUpdate = true;
    this.geometry.computeVertexNormals();
    this.geometry.computeBoundingSphere();
    this.lines.boundingSphere = this.geometry.boundingSphere;
    return true;
  }

  /** Gives every vertex the colour that `paint` writes, as linear red, green, blue, for each of the object's vertices. */
  paint(paint: (vertex: number, into: Float32Array, at: number) => void): void {
    this.weave.source.forEach((vertex, drawn) => paint(vertex, this.#colours.array as Float32Array, 3 * drawn));
    this.#colours.needsUpdate = true;
  }

  dispose(): void {
    this.geometry.dispose();
    this.lines.dispose();
  }
}
