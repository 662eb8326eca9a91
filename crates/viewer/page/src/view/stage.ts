// What stands still: the light, the table with its grid, and the walls.
import {
  BufferGeometry, DirectionalLight, EdgesGeometry, Float32BufferAttribute, Group, HemisphereLight, LineBasicMaterial,
  LineSegments, Mesh, MeshBasicMaterial, PlaneGeometry, ShadowMaterial, type Material, type Object3D, type Vector3,
} from "three";
import type { About } from "../protocol.ts";
import type { Colours } from "./colours.ts";
import type { Layout } from "./layout.ts";
import { wallGeometry, wallPolygon } from "./shapes.ts";

/** The table reaches this many times as far as the scene. */
const TABLE = 4;

export class Stage {
  readonly group = new Group();
  /** Table and sun, which go along with what is looked at. */
  #moving = new Group();
  #step: number;
  #sun = new DirectionalLight();
  #sky = new HemisphereLight();
  #lines = new LineBasicMaterial({ vertexColors: false, transparent: true });
  #table = new ShadowMaterial({ opacity: 0.25, depthWrite: false });
  #wallFill = new MeshBasicMaterial({ transparent: true, opacity: 0.14, depthWrite: false });
  #wallEdges = new LineBasicMaterial({ transparent: true, opacity: 0.7 });

  constructor(about: About, layout: Layout, colours: Colours) {
    this.#step = layout.grid;
    this.#moving.add(this.#sun, this.#sun.target, this.#grid(layout), this.#ground(layout));
    this.group.add(this.#sky, this.#moving);
    this.#light(layout);
    for (const wall of about.walls) {
      // The table is drawn as the ground is.
      if (wall.normal[2] > 0.99) continue;
      const geometry = wallGeometry(wallPolygon(wall, about.walls, layout, about.space), wall, layout);
      if (!geometry) continue;
      const edges = new LineSegments(new EdgesGeometry(geometry), this.#wallEdges);
      this.group.add(new Mesh(geometry, this.#wallFill), edges);
    }
    this.colour(colours);
  }

  /** Goes along with what is looked at, in whole steps of the grid: a line stays where it is. */
  follow(target: Vector3): void {
    const whole = (place: number) => this.#step * Math.round(place / this.#step);
    this.#moving.position.set(whole(target.x), whole(target.y), 0);
  }

  colour(colours: Colours): void {
    this.#lines.color.copy(colours.line);
    this.#lines.opacity = colours.dark ? 0.55 : 0.8;
    this.#table.opacity = colours.dark ? 0.45 : 0.2;
    this.#wallFill.color.copy(colours.muted);
    this.#wallEdges.color.copy(colours.muted);
    this.#sky.intensity = colours.dark ? 1.3 : 1.9;
    this.#sky.color.set("#ffffff");
    this.#sky.groundColor.copy(colours.surface).lerp(colours.muted, 0.6);
    this.#sun.intensity = colours.dark ? 1.6 : 1.9;
  }

  dispose(): void {
    this.group.traverse((object: Object3D & { geometry?: BufferGeometry; material?: Material }) => {
      object.geometry?.dispose();
      object.material?.dispose();
    });
    this.#sun.dispose();
    this.#sky.dispose();
  }

  #light({ centre, radius, ground }: Layout): void {
    this.#sun.position.set(centre[0] - 0.9 * radius, centre[1] - 1.2 * radius, ground + 3.2 * radius);
    this.#sun.target.position.set(...centre);
    this.#sun.castShadow = true;
    this.#sun.shadow.mapSize.set(1024, 1024);
    this.#sun.shadow.bias = -0.0005;
    this.#sun.shadow.normalBias = 0.006 * radius;
    this.#sun.shadow.radius = 3;
    const camera = this.#sun.shadow.camera;
    [camera.left, camera.right, camera.bottom, camera.top] = [-1.8, 1.8, -1.8, 1.8].map((side) => side * radius) as
      [number, number, number, number];
    [camera.near, camera.far] = [0.5 * radius, 8 * radius];
    camera.updateProjectionMatrix();
  }

  #ground({ centre, radius, ground }: Layout): Mesh {
    const mesh = new Mesh(new PlaneGeometry(2 * TABLE * radius, 2 * TABLE * radius), this.#table);
    mesh.position.set(centre[0], centre[1], ground - 1e-4 * radius);
    mesh.receiveShadow = true;
    return mesh;
  }

  /** Lines through whole multiples of the grid's step, so that the origin is on a crossing; they end at a circle. */
  #grid({ radius, ground, grid }: Layout): LineSegments {
    const reach = Math.min(60, Math.ceil((2.2 * radius) / grid));
    const points: number[] = [];
    for (let i = -reach; i <= reach; i++) {
      const half = Math.sqrt(reach ** 2 - i ** 2) * grid;
      points.push(i * grid, -half, ground, i * grid, half, ground);
      points.push(-half, i * grid, ground, half, i * grid, ground);
    }
    const geometry = new BufferGeometry().setAttribute("position", new Float32BufferAttribute(points, 3));
    return new LineSegments(geometry, this.#lines);
  }
}

/** Whether `object` is one that only a fine picture has. */
export function isSun(object: Object3D): object is DirectionalLight {
  return object instanceof DirectionalLight;
}
