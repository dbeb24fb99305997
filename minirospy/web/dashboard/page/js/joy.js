// A gamepad of the browser as sensor_msgs/Joy has it: left and up are positive, in joy_node's order for Xbox pads.
// Pure.
// Sources: https://www.w3.org/TR/gamepad (the standard mapping), http://wiki.ros.org/joy (the tables of axes and
// buttons).

const DEAD_ZONE = 0.05; // of an axis, as joy_node's

const axis = (value = 0) => (Math.abs(value) < DEAD_ZONE ? 0 : Math.max(-1, Math.min(1, -value)) || 0);
const pressed = (button) => (button?.pressed ? 1 : 0);

/** Return {axes, buttons} of a gamepad. */
export function joyOf({ mapping, axes, buttons }) {
  if (mapping !== "standard") return { axes: axes.map(axis), buttons: buttons.map(pressed) };
  // A trigger is 1 if it is released and -1 if it is pulled, as the driver of Linux has it.
  const trigger = (button) => 1 - 2 * (button?.value ?? 0);
  const pair = (plus, minus) => pressed(buttons[plus]) - pressed(buttons[minus]);
  return {
    axes: [
      axis(axes[0]),
      axis(axes[1]),
      trigger(buttons[6]),
      axis(axes[2]),
      axis(axes[3]),
      trigger(buttons[7]),
      pair(14, 15),
      pair(12, 13),
    ],
    buttons: [0, 1, 2, 3, 4, 5, 8, 9, 16, 10, 11].map((index) => pressed(buttons[index])),
  };
}
