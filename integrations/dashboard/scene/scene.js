// The robot in three dimensions: its links as they are declared, moved by its joints and placed by an estimate. The page loads it when its
// tab is first opened.
import {
  AmbientLight, AxesHelper, BoxGeometry, BufferGeometry, Color, CylinderGeometry, DirectionalLight, Fog, Group, Line, LineBasicMaterial,
  LineSegments, Mesh, MeshStandardMaterial, Object3D, PerspectiveCamera, Scene, SphereGeometry, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { STLLoader } from "three/examples/jsm/loaders/STLLoader.js";

const TRAIL = 600;
// The grid, m.
const GRID = 40, CELL = 0.5;

export class RobotScene {
  // `box` is filled with a canvas; `description` has the links and joints; `load` returns the bytes of the mesh of that name, or nothing.
  constructor(box, description, load) {
    // Z points up, as in the robot.
    Object3D.DEFAULT_UP.set(0, 0, 1);
    this.box = box;
    this.renderer = new WebGLRenderer({ antialias: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    box.replaceChildren(this.renderer.domElement);
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(45, 1, 0.01, 500);
    const sun = new DirectionalLight(0xffffff, 2.2);
    sun.position.set(3, -2, 6);
    this.scene.add(new AmbientLight(0xffffff, 1.4), sun);
    this.robot = new Group();
    this.scene.add(this.robot);
    this.joints = new Map();
    this.load = load;
    this.build(description);
    this.trail = [];
    this.line = new Line(new BufferGeometry(), new LineBasicMaterial({ fog: false }));
    this.scene.add(this.line);
    this.controls = new OrbitControls(this.camera, this.renderer.domElement);
    this.controls.addEventListener("change", () => this.draw());
    this.reset();
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(box);
    this.paint();
    this.resize();
  }

  build({ links, joints }) {
    const groups = new Map(links.map((link) => [link.name, new Group()]));
    const isShown = links.some((link) => link.visuals.length);
    for (const joint of joints) {
      const frame = new Group(), motion = new Group();
      move(frame, joint.origin);
      frame.add(motion);
      motion.add(groups.get(joint.child));
      groups.get(joint.parent).add(frame);
      this.joints.set(joint.name, motion);
      if (!isShown) groups.get(joint.parent).add(bone(frame.position));
    }
    for (const link of links) {
      const group = groups.get(link.name);
      if (!joints.some((joint) => joint.child === link.name)) this.robot.add(group);
      for (const visual of link.visuals) {
        const part = shape(visual);
        group.add(part);
        if (visual.geometry.mesh) this.fill(part.children[0], visual.geometry.mesh);
      }
      if (!isShown) group.add(new Mesh(new SphereGeometry(0.03, 24, 16), material(null)), new AxesHelper(0.12));
    }
  }

  // Exchanges the mark of a mesh for what its file holds.
  async fill(part, { file, scale }) {
    try {
      const bytes = await this.load?.(file);
      if (!bytes) return;
      const body = new STLLoader().parse(bytes);
      part.geometry.dispose();
      part.geometry = body;
      part.scale.set(...scale);
      part.name = file;
    } catch (error) {
      console.warn(`the mesh ${file} is not shown: ${error.message}`);
      return;
    }
    if (!this.isPlaced) this.reset();
    this.draw();
  }

  // Where it is seen from: at an angle, the whole robot in the picture.
  reset() {
    const far = Math.max(1, this.size() * 3);
    const { x, y, z } = this.robot.position;
    this.camera.position.set(x + far * 0.8, y - far, z + far * 0.7);
    this.controls.target.set(x, y, z + this.size() * 0.25);
    this.controls.update();
  }

  size() {
    let size = 0.4;
    this.robot.traverse((part) => {
      if (!part.isMesh) return;
      part.geometry.computeBoundingSphere();
      const { center, radius } = part.geometry.boundingSphere;
      const middle = part.localToWorld(center.clone()).distanceTo(this.robot.position);
      size = Math.max(size, middle + radius * Math.max(...part.getWorldScale(new Vector3()).toArray().map(Math.abs)));
    });
    return size;
  }

  // The motions of joints, by name.
  move(joints) {
    for (const [name, state] of Object.entries(joints)) {
      const motion = this.joints.get(name);
      if (motion && state.motion) move(motion, state.motion);
    }
    this.draw();
  }

  // The place of the root link in the world.
  place({ xyz, quaternion }) {
    const before = this.robot.position.clone();
    move(this.robot, { xyz, quaternion });
    // The camera goes along.
    const step = this.robot.position.clone().sub(before);
    this.camera.position.add(step);
    this.controls.target.add(step);
    this.isPlaced = true;
    this.follow();
    const last = this.trail.at(-1);
    if (!last || last.distanceTo(this.robot.position) > 0.02) {
      this.trail.push(this.robot.position.clone());
      if (this.trail.length > TRAIL) this.trail.shift();
      this.line.geometry.dispose();
      this.line.geometry = new BufferGeometry().setFromPoints(this.trail);
    }
    this.controls.update();
    this.draw();
  }

  // The grid goes along by whole cells, so that it seems to stay.
  follow() {
    const cell = (coordinate) => Math.round(coordinate / CELL) * CELL;
    this.grid.position.set(cell(this.robot.position.x), cell(this.robot.position.y), 0);
  }

  // The colours of the page.
  paint() {
    const colour = (name) => new Color(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
    this.scene.background = colour("--card");
    this.line.material.color = colour("--blue");
    this.scene.remove(this.grid);
    this.grid?.geometry.dispose();
    this.grid = grid(colour("--line"));
    // Far lines would flicker.
    this.scene.fog = new Fog(this.scene.background, 1, 2);
    this.follow();
    this.scene.add(this.grid);
    this.draw();
  }

  // Gives the canvas back: a browser has room for few.
  dispose() {
    this.observer.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    this.isDue = true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.box;
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      this.drawn = (this.drawn ?? 0) + 1;
      const far = this.camera.position.distanceTo(this.controls.target);
      this.scene.fog.near = 1.5 * far;
      this.scene.fog.far = 1.5 * far + GRID / 3;
      this.renderer.render(this.scene, this.camera);
    });
  }
}

function move(group, { xyz, quaternion }) {
  group.position.set(...xyz);
  group.quaternion.set(...quaternion);
}

function material(colour) {
  const [red, green, blue, opacity] = colour ?? [0.55, 0.6, 0.68, 1];
  return new MeshStandardMaterial({ color: new Color().setRGB(red, green, blue, "srgb"), opacity, transparent: opacity < 1, roughness: 0.7, metalness: 0.1, fog: false });
}

// The floor, about its middle. A line for each side of a cell: of one that passes behind the camera, some renderers show nothing.
function grid(color) {
  const points = [], half = GRID / 2;
  for (let along = -half; along < half; along += CELL) for (let across = -half; across <= half; across += CELL) {
    points.push(new Vector3(along, across, 0), new Vector3(along + CELL, across, 0), new Vector3(across, along, 0), new Vector3(across, along + CELL, 0));
  }
  return new LineSegments(new BufferGeometry().setFromPoints(points), new LineBasicMaterial({ color }));
}

function shape({ geometry, origin, color }) {
  const mesh = new Mesh(bodyOf(geometry), material(color));
  const group = new Group();
  group.add(mesh);
  move(group, origin);
  // A cylinder of three.js is along y.
  if (geometry.cylinder) mesh.rotation.x = Math.PI / 2;
  return group;
}

function bodyOf({ box, cylinder, sphere, mesh }) {
  if (box) return new BoxGeometry(...box);
  if (cylinder) return new CylinderGeometry(cylinder.radius, cylinder.radius, cylinder.length, 48);
  if (sphere) return new SphereGeometry(sphere.radius, 48, 24);
  // The place of a mesh is marked until its file has come.
  return new BoxGeometry(...(mesh?.scale ?? [1, 1, 1]).map((factor) => 0.05 * Math.min(Math.max(Math.abs(factor), 0.1), 2)));
}

// A rod to the next joint, of a robot without declared shapes.
function bone(to) {
  return new Line(new BufferGeometry().setFromPoints([new Vector3(), to]), new LineBasicMaterial({ color: 0x8a94a3 }));
}
