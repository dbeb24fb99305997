// Messages on the wire, pickles and gamepads.
import assert from "node:assert/strict";
import { test } from "node:test";

import { joyOf } from "../../../minirospy/web/dashboard/page/js/joy.js";
import { PickleError, readPickle } from "../../../minirospy/web/dashboard/page/js/pickle.js";
import {
  decode,
  encode,
  MessageError,
  parseDefinition,
  zeroOf,
} from "../../../minirospy/web/dashboard/page/js/ros1.js";

const LINE = "=".repeat(80);
const DEFINITION = parseDefinition(
  "a/B",
  `int64 big\nstring s\nfloat32[] list\nC[2] parts\ntime t\nbool ok\n${LINE}\nMSG: a/C\nuint8 x`,
);

test("a message is decoded as it was encoded", () => {
  const message = {
    big: -(2n ** 62n),
    s: "aż\u{1f422}",
    list: [1.5, -2],
    parts: [{ x: 1 }, { x: 255 }],
    t: { secs: 3, nsecs: 4 },
    ok: true,
  };
  const decoded = decode(DEFINITION, encode(DEFINITION, message));
  assert.equal(BigInt(decoded.big), message.big);
  assert.deepEqual({ ...decoded, big: 0, list: [...decoded.list] }, { ...message, big: 0 });
});

test("zeros are a message of the right length", () => {
  const bytes = encode(DEFINITION, zeroOf(DEFINITION));
  assert.equal(bytes.length, 8 + 4 + 4 + 2 + 8 + 1);
});

test("too few and too many bytes or elements are refused", () => {
  const bytes = encode(DEFINITION, zeroOf(DEFINITION));
  assert.throws(() => decode(DEFINITION, bytes.subarray(1)), MessageError);
  assert.throws(() => decode(DEFINITION, new Uint8Array([...bytes, 0])), MessageError);
  assert.throws(() => encode(DEFINITION, { ...zeroOf(DEFINITION), parts: [{ x: 1 }] }), /values/);
  assert.throws(() => encode(DEFINITION, { ...zeroOf(DEFINITION), list: 3 }), /not an array/);
});

test("an array that announces more than there is costs no memory", () => {
  const definition = parseDefinition("a/D", "float64[] list");
  assert.throws(() => decode(definition, new Uint8Array([255, 255, 255, 127])), MessageError);
});

test("a pickle of plain values is read, and an object is only named", () => {
  const bytes = (text) => Uint8Array.from(text, (each) => each.charCodeAt(0));
  // pickle.dumps({"a": [1, None]}, 0)
  assert.deepEqual([...readPickle(bytes("(dp0\nVa\np1\n(lp2\nI1\naNas."))], [["a", [1, null]]]);
  assert.equal(readPickle(bytes("cos\nsystem\n.")).kind, "os.system");
  for (const cut of ["", "(", "V", "\x80\x04\x95\xff\xff\xff\xff\xff\xff\xff\xff", "0."])
    assert.throws(() => readPickle(bytes(cut)), PickleError);
});

test("a standard gamepad has the order of joy_node", () => {
  const buttons = Array.from({ length: 17 }, (_, index) => ({ pressed: index === 15, value: index === 6 ? 1 : 0 }));
  const { axes, buttons: pressed } = joyOf({ mapping: "standard", axes: [0.5, -1, 0.01, 0], buttons });
  assert.deepEqual(axes, [-0.5, 1, -1, 0, 0, 1, -1, 0]);
  assert.equal(pressed.length, 11);
});
