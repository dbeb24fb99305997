// Displays of poses and of what is made of points: paths, polygons, odometry, ranges, forces.

import { ConeGeometry, Group, InstancedMesh, Matrix4, Mesh, Vector3 } from "../../../vendor/three/three.min.js";
import { arrow, axes, BALL, bodyMaterial, BOX, chain, directed, ellipse, plainMaterial, segments } from "../shapes.js";
import { fromMessage } from "../transforms.js";
import { t } from "../../texts.js";
import { TopicDisplay } from "./display.js";

const MAX_KEPT = 2000;

function posed(object, pose) {
  const { p, q } = fromMessage(pose);
  object.position.fromArray(p);
  object.quaternion.fromArray(q);
  return object;
}

const isFinitePose = ({ position, orientation }) =>
  [...Object.values(position), ...Object.values(orientation)].every(Number.isFinite);

function grouped(...objects) {
  const group = new Group();
  group.add(...objects);
  return group;
}

/** A display whose settings only change how the last message looks. */
class LastMessage extends TopicDisplay {
  /** Return the object that shows a message. @returns {any} */
  make(_message) {
    throw new TypeError(`${this.constructor.name} makes no object`);
  }

  start() {
    this.message = null;
    super.start();
  }

  changed(path) {
    if (/Topic$/.test(path) || !this.message) this.restart();
    else this.show(this.message);
  }

  received(message) {
    this.show(message);
    this.message = message;
  }

  show(message) {
    const made = this.make(message);
    for (const item of [...this.items]) this.remove(item);
    this.addAt(message.header, made);
  }

  /** Return the arrow or axes of the settings. */
  pointer() {
    if (this.get("Shape") === "Axes") return axes(this.number("Axes Length", 1), this.number("Axes Radius", 0.1));
    return arrow(bodyMaterial(this.color(), this.number("Alpha", 1)), {
      // Diameters, as in RViz.
      shaft: this.number("Shaft Length", 1),
      shaftWidth: this.number("Shaft Radius", 0.05),
      head: this.number("Head Length", 0.3),
      headWidth: this.number("Head Radius", 0.1),
    });
  }
}

export class Pose extends LastMessage {
  make(message) {
    const stamped = message.pose.pose ?? message.pose;
    if (!isFinitePose(stamped)) throw new Error(t("Message contained invalid floating point values (nans or infs)"));
    const group = grouped(posed(this.pointer(), stamped));
    if (message.pose.covariance && this.get("Covariance/Position/Value") !== false) {
      const ball = ellipse(message.pose.covariance);
      ball.position.fromArray(fromMessage(stamped).p);
      group.add(ball);
    }
    return group;
  }
}

export class PoseArray extends LastMessage {
  make({ poses }) {
    const shown = poses.filter(isFinitePose);
    this.setStatus(
      "Poses",
      shown.length < poses.length ? 1 : 0,
      t("{count} of {all} poses", { count: shown.length, all: poses.length }),
    );
    const shape = this.get("Shape");
    if (shape === "Arrow (Flat)") {
      // Lines of one object: thousands of particles are usual.
      const length = this.number("Arrow Length", 0.3);
      const parts = [
        [0, 0, 1, 0],
        [1, 0, 0.75, 0.2],
        [1, 0, 0.75, -0.2],
      ];
      const positions = new Float32Array(shown.length * 18);
      shown.forEach((pose, index) => {
        const transform = new Matrix4().compose(
          new Vector3(...fromMessage(pose).p),
          posed(new Group(), pose).quaternion,
          new Vector3(1, 1, 1),
        );
        parts.forEach(([x0, y0, x1, y1], part) => {
          new Vector3(x0 * length, y0 * length, 0).applyMatrix4(transform).toArray(positions, index * 18 + part * 6);
          new Vector3(x1 * length, y1 * length, 0)
            .applyMatrix4(transform)
            .toArray(positions, index * 18 + part * 6 + 3);
        });
      });
      return positions.length
        ? segments(positions, { rgb: this.color(), alpha: this.number("Alpha", 1) })
        : new Group();
    }
    const material = bodyMaterial(this.color(), this.number("Alpha", 1));
    const make =
      shape === "Axes"
        ? () => axes(this.number("Axes Length", 0.3), this.number("Axes Radius", 0.01))
        : () =>
            arrow(material, {
              shaft: this.number("Shaft Length", 0.23),
              shaftWidth: this.number("Shaft Radius", 0.01),
              head: this.number("Head Length", 0.07),
              headWidth: this.number("Head Radius", 0.03),
            });
    return grouped(new Group(), ...shown.slice(0, MAX_KEPT).map((pose) => posed(make(), pose)));
  }
}

/** Arrows of the last poses; with "Trail", which RViz does not have, a line through so many of them. */
export class Odometry extends LastMessage {
  start() {
    this.last = null;
    this.trail = []; // positions
    this.line = null; // item
    super.start();
  }

  changed() {
    this.restart();
  }

  show(message) {
    const { pose } = message.pose;
    if (!isFinitePose(pose)) throw new Error(t("Message contained invalid floating point values (nans or infs)"));
    const now = fromMessage(pose);
    const trail = Math.min(MAX_KEPT, this.number("Trail"));
    const most = Math.min(MAX_KEPT, this.number("Keep", 100) || MAX_KEPT);
    let isNew = true;
    if (this.last) {
      const moved = Math.hypot(...now.p.map((value, index) => value - this.last.p[index]));
      const turned =
        2 * Math.acos(Math.min(1, Math.abs(now.q.reduce((sum, value, index) => sum + value * this.last.q[index], 0))));
      isNew = moved >= this.number("Position Tolerance", 0.1) || turned >= this.number("Angle Tolerance", 0.1);
      // A single arrow with a trail is where the robot is; others, or one alone, are where it was when they were added.
      if (!isNew && (trail <= 0 || most > 1)) return;
    }
    if (isNew) this.last = now;
    if (trail > 0) this.follow(message.header, now.p, trail, isNew);
    const group = grouped(posed(this.pointer(), pose));
    if (this.ball) this.ball.removeFromParent();
    if (this.get("Covariance/Position/Value") !== false && message.pose.covariance.some((value) => value > 0)) {
      // Of the newest only, or the trail is covered.
      this.ball = ellipse(message.pose.covariance);
      this.ball.position.fromArray(now.p);
      group.add(this.ball);
    }
    this.addAt(message.header, group);
    this.keep(this.line ? most + 1 : most);
  }

  /** Draw the line through the last positions. */
  follow(header, position, most, isNew) {
    if (isNew) this.trail.push(position);
    this.trail.splice(0, this.trail.length - most);
    const points = isNew ? this.trail : [...this.trail, position];
    if (this.line) this.remove(this.line);
    const line = segments(chain(Float32Array.from(points.flat())), {
      rgb: this.color(),
      alpha: this.number("Alpha", 1),
    });
    this.line = this.addAt(header, grouped(line));
  }

  /** Keep so many of the newest items, and the line. */
  keep(most) {
    for (const item of [...this.items]) {
      if (this.items.size <= Math.max(1, most)) return;
      if (item !== this.line) this.remove(item);
    }
  }
}

export class Path extends LastMessage {
  make({ header, poses }) {
    const points = new Float32Array(poses.length * 3);
    poses.forEach(({ pose }, index) => {
      const { x, y, z } = pose.position;
      points.set([x, y, z], index * 3);
    });
    if (!points.every(Number.isFinite))
      throw new Error(t("Message contained invalid floating point values (nans or infs)"));
    // Poses of other frames are drawn as if they were in the path's: RViz does that, too, and names none.
    const others = poses.filter(({ header: own }) => own.frame_id && own.frame_id !== header.frame_id).length;
    this.setStatus(
      "Poses",
      others ? 1 : 0,
      t("{count} poses", { count: poses.length }) +
        (others ? t(", {count} of another frame than the path's", { count: others }) : ""),
    );
    const group = new Group();
    group.position.fromArray(["X", "Y", "Z"].map((name) => this.number(`Offset/${name}`)));
    const isBroad = this.get("Line Style") === "Billboards";
    if (poses.length > 1) {
      // RViz draws broad lines without their alpha.
      group.add(
        segments(chain(points), {
          rgb: this.color(),
          alpha: isBroad ? 1 : this.number("Alpha", 1),
          metres: isBroad ? this.number("Line Width", 0.03) : null,
        }),
      );
    }
    const style = this.get("Pose Style");
    if (style === "Axes" || style === "Arrows") {
      const material = bodyMaterial(this.color("Pose Color"));
      const make =
        style === "Axes"
          ? () => axes(this.number("Length", 0.3), this.number("Radius", 0.03))
          : () =>
              arrow(material, {
                shaft: this.number("Shaft Length", 0.1),
                shaftWidth: this.number("Shaft Diameter", 0.1),
                head: this.number("Head Length", 0.2),
                headWidth: this.number("Head Diameter", 0.3),
              });
      for (const { pose } of poses.slice(0, MAX_KEPT)) group.add(posed(make(), pose));
    }
    return grouped(group);
  }

  show(message) {
    const most = Math.max(1, this.number("Buffer Length", 1));
    if (most === 1) super.show(message);
    else {
      this.addAt(message.header, this.make(message));
      this.keep(most);
    }
  }
}

export class Polygon extends LastMessage {
  make({ polygon: { points } }) {
    const all = [...points, points[0]].filter(Boolean);
    return points.length > 1
      ? segments(chain(Float32Array.from(all.flatMap(({ x, y, z }) => [x, y, z]))), {
          rgb: this.color(),
          alpha: this.number("Alpha", 1),
        })
      : new Group();
  }
}

export class Range extends LastMessage {
  make({ range, field_of_view: angle, min_range: least, max_range: most }) {
    // As RViz: a fixed distance (least = most) that is not reached is nothing.
    const shown = least === most && range > 0 ? most : range;
    if (!(shown > 0) || !Number.isFinite(shown)) {
      this.setStatus("Range", 0, t("nothing in range ({range})", { range }));
      return new Group();
    }
    this.setStatus("Range", 0, `${Number(shown.toFixed(4))} m`);
    const width = 2 * shown * Math.tan(Math.min(angle, 3) / 2);
    const cone = new Mesh(
      new ConeGeometry(width / 2, shown, 32).rotateZ(Math.PI / 2).translate(shown / 2, 0, 0),
      bodyMaterial(this.color(), Math.min(this.number("Alpha", 0.5), 0.99)),
    );
    return grouped(cone);
  }
}

export class PointStamped extends LastMessage {
  show(message) {
    const { x, y, z } = message.point;
    const size = this.number("Radius", 0.2) * 2;
    const ball = new Mesh(BALL, bodyMaterial(this.color(), this.number("Alpha", 1)));
    ball.position.set(x, y, z);
    ball.scale.setScalar(size);
    this.addAt(message.header, grouped(ball));
    this.keep(this.number("History Length", 1));
  }
}

export class GridCells extends LastMessage {
  make({ cells, cell_width: width, cell_height: height }) {
    const mesh = new InstancedMesh(BOX, plainMaterial(this.color(), this.number("Alpha", 1)), cells.length);
    const matrix = new Matrix4().makeScale(width * 0.96, height * 0.96, 0.002);
    cells.forEach(({ x, y, z }, index) => mesh.setMatrixAt(index, matrix.setPosition(x, y, z)));
    return grouped(mesh);
  }
}

export class Wrench extends LastMessage {
  make({ wrench: { force, torque } }) {
    const width = this.number("Arrow Width", 0.5);
    const group = new Group();
    const shown = [
      [force, "Force Color", this.number("Force Arrow Scale", 2)],
      [torque, "Torque Color", this.number("Torque Arrow Scale", 2)],
    ];
    for (const [{ x, y, z }, name, scale] of shown) {
      const vector = new Vector3(x, y, z).multiplyScalar(scale);
      const length = vector.length();
      if (!Number.isFinite(length))
        throw new Error(t("Message contained invalid floating point values (nans or infs)"));
      if (length < 1e-6 || (length <= width && this.get("Hide Small Values") !== false)) continue;
      // As RViz: the shaft alone is as long as the value.
      const material = bodyMaterial(this.color(name), this.number("Alpha", 1));
      const shape = arrow(material, {
        shaft: length,
        shaftWidth: 0.1 * width,
        head: length * 0.3,
        headWidth: 0.2 * width,
      });
      group.add(directed(shape, new Vector3(), vector));
      if (name === "Torque Color") group.add(this.turn(vector, width, material));
    }
    return group;
  }

  /** Return the circle around a torque's arrow, with the direction in which it turns. */
  turn(vector, width, material) {
    const length = vector.length();
    const group = new Group();
    const points = Float32Array.from({ length: 29 }, (_, step) => ((step + 4) * Math.PI) / 16).reduce(
      (all, angle) => [...all, (Math.cos(angle) * length) / 4, (Math.sin(angle) * length) / 4, length / 2],
      [],
    );
    group.add(
      segments(chain(Float32Array.from(points)), {
        rgb: this.color("Torque Color"),
        alpha: this.number("Alpha", 1),
        metres: width * 0.05,
      }),
    );
    const head = arrow(material, { shaft: 0, shaftWidth: 0, head: width * 0.1, headWidth: width * 0.2 });
    group.add(directed(head, new Vector3(length / 4, 0, length / 2), new Vector3(length / 4, 1, length / 2)));
    group.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), vector.clone().normalize());
    return group;
  }
}

/** What another view shows: the display only has a link to it. */
export class Linked extends TopicDisplay {
  start() {
    const topic = String(this.get("Image Topic") ?? "");
    this.setStatus("Topic", topic ? 0 : 1, topic ? t("Shown by the view Image") : t("No topic is set"));
  }
}
