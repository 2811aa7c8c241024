// Capsules of the virtual actor: shapes of a body, and where a pose places them.
import { add, rotate, times } from './linear_algebra.js';

export const LEFT = [1.0, 0.62, 0.3];
export const RIGHT = [0.3, 0.66, 1.0];
export const MIDDLE = [0.86, 0.88, 0.92];
const LOST = [0.5, 0.52, 0.56];
const LIMB_PARTS = {
  right_arm: ['right_upper_arm', 'right_lower_arm'], left_arm: ['left_upper_arm', 'left_lower_arm'],
  right_leg: ['right_upper_leg', 'right_lower_leg', 'right_foot'],
  left_leg: ['left_upper_leg', 'left_lower_leg', 'left_foot'],
};
const LAST_PARTS = /head|lower_arm|foot/;  // no part follows them: their round end must stay within their length
const LOST_OPACITY = 0.45;

export const colourOf = (part) => (part.startsWith('left') ? LEFT : part.startsWith('right') ? RIGHT : MIDDLE);

// Shapes of a body, each in the frame of its part: start and length along +Y, radii and cap heights at both ends.
export function shapesOf(body) {
  const has = new Set(body.parts);
  const shapes = [];
  body.parts.forEach((part, k) => {
    const length = body.lengths[k];
    const near = body.near.slice(2 * k, 2 * k + 2);
    const far = body.far.slice(2 * k, 2 * k + 2);
    const push = (start, end, nearRadii, farRadii, nearCap, farCap) => shapes.push({
      k, part, start, length: Math.max(end - start, 0.001), near: nearRadii, far: farRadii, caps: [nearCap, farCap],
    });
    if (part === 'head' && !has.has('neck_column')) {  // head and neck are one cylinder in [Two-view]
      const neck = near.map((r) => 0.58 * Math.min(...near, r));
      push(0, 0.4 * length, neck, neck, 0.02, 0.02);
      const skull = 0.42 * length;
      push(0.3 * length + skull, length - skull * 0.62, near, near.map((r) => 0.93 * r), skull, skull * 0.62);
      return;
    }
    if (part === 'head') {
      const skull = 0.42 * length;
      push(skull, length - skull, near, far, skull, skull);
      return;
    }
    const small = [Math.min(...near), Math.min(...far)];
    if (/torso|chest|pelvis|neck_column/.test(part)) {
      push(0, length, near, far, 0.55 * small[0], 0.45 * small[1]);
      return;
    }
    const isEnd = LAST_PARTS.test(part) || (part.endsWith('lower_leg') && !has.has(part.replace('lower_leg', 'foot')));
    const tip = isEnd ? Math.min(small[1], 0.45 * length) : 0;
    push(0, length - tip, near, far, small[0], isEnd ? tip : small[1]);
  });
  return shapes;
}

// The shapes of a body in the world, with their colours.
export function placedCapsules(body, pose) {
  const personLost = pose.lost.includes('person');
  const lostParts = new Set(pose.lost.flatMap((limb) => LIMB_PARTS[limb] || []));
  return body.shapes.map((shape) => {
    const rotation = pose.quaternions.slice(4 * shape.k, 4 * shape.k + 4);
    const nearEnd = pose.positions.slice(3 * shape.k, 3 * shape.k + 3);
    const origin = add(nearEnd, rotate(rotation, [0, shape.start, 0]));
    const lost = personLost || lostParts.has(shape.part);
    return {
      ...shape, rotation, origin, end: add(origin, rotate(rotation, [0, shape.length, 0])),
      colour: [...(lost ? LOST : colourOf(shape.part)), lost ? LOST_OPACITY : 1],
    };
  });
}

// World position of a joint centre by its name in exports, such as 'RWrist'; null for an unknown name.
export function jointCentre(body, pose, name) {
  const k = body.markers.indexOf(name);
  return k < 0 ? null : pose.centres.slice(3 * k, 3 * k + 3);
}

// World positions of hands and feet: the far ends of the last parts of the limbs.
export function limbEnds(body, pose) {
  const has = new Set(body.parts);
  return ['right', 'left'].flatMap((side) => {
    const foot = has.has(`${side}_foot`) ? `${side}_foot` : `${side}_lower_leg`;
    return [`${side}_lower_arm`, foot].map((part) => {
      const k = body.parts.indexOf(part);
      if (k < 0) return null;
      const rotation = pose.quaternions.slice(4 * k, 4 * k + 4);
      const at = add(pose.positions.slice(3 * k, 3 * k + 3), rotate(rotation, times([0, 1, 0], body.lengths[k])));
      return { name: part, at, colour: colourOf(part) };
    });
  }).filter(Boolean);
}
