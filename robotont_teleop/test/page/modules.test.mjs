// The page's modules that know no browser: who drives, what a stick does, its curve, a gamepad out of reach.
import assert from "node:assert";
import {test} from "node:test";

import {commandRate} from "../../web/command_rate.js";
import {actWhenHeld} from "../../web/hold_button.js";
import {Pad, Pads, STILL} from "../../web/pad.js";
import {Link} from "../../web/server_link.js";
import {REACH, position} from "../../web/stick_curve.js";
import {truth} from "../../web/truth.js";

const STATE = {stopped: false, driver: null, held: [], driven_by: "nobody", mover: ["nobody", ""]};
const say = (state, more = {}) => {
  const {who, can, live} = truth({open: true, stalled: false, page: 1, status: {lights: []}, ...more,
    state: {...STATE, ...state}});
  return [who.join(" ").trim(), can, live];
};

test("who moves the robot, whoever has the seat", () => {
  assert.deepEqual(say({}), ["who_nobody", "can_drive", true]);
  assert.deepEqual(say({driver: 1}), ["who_yours", "can_drive", true]);
  assert.deepEqual(say({driver: 1, mover: ["page", ""]}), ["who_you", "can_stop", true]);
  assert.deepEqual(say({driver: 2, mover: ["page", ""]}), ["who_other", "can_take_over", false]);
  assert.deepEqual(say({driver: 2}), ["who_others", "can_take_over", false]);
  assert.deepEqual(say({driver: 1, mover: ["program", "square"]}), ["who_program square", "can_mix", true]);
  assert.deepEqual(say({driven_by: "default", mover: ["program", "a"]}), ["who_program a", "can_take_it", true]);
  assert.deepEqual(say({driver: 1, mover: ["navigation", "x"]}), ["who_navigation", "can_take_it", true]);
  assert.deepEqual(say({driver: 1, mover: ["hand", "keyboard_teleop_7"]}), ["who_keys", "can_hand_first", false]);
  assert.deepEqual(say({driver: 1, mover: ["hand", "joy_teleop"]}, {status: {lights: [
    {level: 1, key: "barred", name: "cmd_vel_mux: who drives"}]}}), ["who_gamepad", "can_drive", true]);
});

test("sticks are off wherever they cannot move it", () => {
  const lit = (level, key, name = "") => say({}, {status: {lights: [{level, key, name}]}}).slice(1);
  assert.deepEqual(say({stopped: true, driver: 1}), ["stopped", "can_release", false]);
  assert.deepEqual(say({stopped: true, stop_waits: true, mover: ["program", "a"]}),
    ["who_program a", "can_release", false]);
  assert.deepEqual(say({driven_by: ""}).slice(1), ["can_no_mux", false]);
  assert.deepEqual(say({held: [1]}).slice(1), ["can_let_go", false]);
  for (const light of [[2, "port_missing"], [2, "board_unknown"], [3, "silent", "serial_com_node: link"]]) {
    assert.deepEqual(lit(...light), ["can_no_board", false]);
  }
  assert.deepEqual(lit(1, "no_driver"), ["can_nothing", false]);
  assert.deepEqual(lit(1, "board_unknown"), ["can_drive", true]);
  assert.deepEqual(lit(1, "board_silent", "serial_com_node: link"), ["can_try", true]);
  assert.deepEqual(lit(2, "", "serial_com_node: link"), ["can_try", true]);
  assert.deepEqual(lit(1, "", "serial_com_node: link"), ["can_drive", true]); // it is driven nevertheless
  assert.deepEqual(lit(1, "line_noisy", "serial_com_node: link"), ["can_drive", true]);
  const replaced = [{level: 3, key: "silent", name: "serial_com_node: link"}, {level: 0, key: "", name: "robotont_node: link"}];
  assert.deepEqual(say({}, {status: {lights: replaced}}).slice(1), ["can_drive", true]);
  assert.deepEqual(say({}, {stalled: true}).slice(1), ["can_wait", false]);
  assert.deepEqual(truth({open: false}), {who: ["lost", ""], can: "can_nothing", live: false});
});

test("a held button acts once a press, with what was seen at its beginning", (t) => {
  const on = {}, acted = [], nothing = {addEventListener: () => {}}, preventDefault = () => {};
  Object.assign(globalThis, {window: nothing, document: nothing});
  t.mock.method(globalThis, "setTimeout", (then) => (later = then));
  let seen = 1, later = null;
  actWhenHeld({addEventListener: (event, act) => (on[event] = act), classList: {toggle() {}, remove() {}}},
    (then) => acted.push(then), () => seen);
  on.pointerdown({preventDefault});
  seen = 2;
  later();
  on.pointerup();
  on.keydown({code: "Enter", repeat: false});
  later();
  later = null;
  on.keydown({code: "Enter", repeat: true});
  assert.deepEqual([acted, later], [[1, 2], null]);
});

class Socket {
  static CONNECTING = 0;
  static OPEN = 1;
  static all = [];
  readyState = 0;
  bufferedAmount = 0;
  sent = [];

  constructor() {
    Socket.all.push(this);
  }

  send(text) {
    this.sent.push(JSON.parse(text).kind);
  }

  close() {
    this.readyState = 3;
    this.onclose?.();
  }
}

function makeLink(t) {
  Socket.all = [];
  Object.assign(globalThis, {location: {origin: "http://robot"}, WebSocket: Socket});
  t.mock.method(globalThis, "setInterval", () => 0);
  t.mock.method(globalThis, "setTimeout", () => 0);
  const link = new Link({connection() {}});
  const hello = (page) => (link.socket.readyState = 1) && link.receive({kind: "hello", page, time: 1});
  const state = (pressed_here, pressed_at) => link.receive({kind: "state", time: 1, stopped: true, pressed_here, pressed_at});
  return {link, hello, state};
}

test("a STOP goes out again until the server presses it, whoever else has pressed", (t) => {
  const {link, hello, state} = makeLink(t);
  hello(1);
  state(false, 5);
  link.stop(); // and it is lost
  state(false, 6);
  link.giveUp();
  hello(2);
  assert.deepEqual(link.socket.sent, ["stop"]);
  state(true, 7);
  link.giveUp();
  hello(3);
  assert.deepEqual(link.socket.sent, []);
  assert.equal(link.stopWanted, null);
});

test("what is pressed as soon as the page is connected goes out, before the first state", (t) => {
  const {link, hello} = makeLink(t);
  link.order({kind: "take"});
  hello(1);
  link.order({kind: "take"});
  assert.deepEqual(link.socket.sent, ["take"]);
});

test("a page whose STOP has not arrived is not left for a token", async (t) => {
  const {link, hello, state} = makeLink(t);
  hello(1);
  link.stop();
  t.mock.method(globalThis, "fetch", async () => ({status: 401}));
  await link.lookForToken();
  hello(2);
  assert.ok(link.socket.sent.includes("stop"));
});

test("that the server still presses, by an older STOP, is no word that this one has arrived", (t) => {
  const {link, hello, state} = makeLink(t);
  hello(1);
  link.stop();
  state(true, 7);
  link.stop(); // behind a release that is on its way, and lost with the connection
  state(true, 7);
  assert.ok(link.stopWanted);
  link.giveUp();
  hello(2);
  assert.deepEqual(link.socket.sent, ["stop"]);
  state(false, 7);
  state(true, 9);
  assert.equal(link.stopWanted, null);
});

test("an attempt to connect that an outage has caught does not hold up the next", async (t) => {
  makeLink(t);
  const due = setTimeout.mock.calls.map(({arguments: [then]}) => then);
  t.mock.method(globalThis, "fetch", async (_, {signal}) => signal || new Promise(() => {}));
  due[0](); // the time of the first attempt is over
  setTimeout.mock.calls.at(-1).arguments[0]();
  await new Promise((resolve) => setImmediate(resolve));
  assert.equal(Socket.all.length, 2);
});

test("commands go out at once where there were few, and 125 in a second at most", (t) => {
  let now = 1000, later = null, sent = 0, still = false, repeat = null;
  t.mock.method(performance, "now", () => now);
  t.mock.method(globalThis, "setTimeout", (then) => (later = then));
  t.mock.method(globalThis, "setInterval", (then) => (repeat = then));
  const changed = commandRate(() => still, () => (sent += 1));
  changed();
  now += 5;
  repeat(); // a movement right after a repetition needs no timer
  changed();
  assert.deepEqual([sent, later], [3, null]);
  for (const end = now + 1000; now < end; now += 1) {
    changed();
  }
  assert.ok(sent > 120 && sent <= 131, sent);
  still = true;
  changed();
  const stop = sent;
  changed();
  repeat();
  assert.equal(sent, stop, "one zero, at once");
});

test("a stick is still in its middle, soft behind it, full at its reach, and never more", () => {
  assert.ok(REACH * 2 >= 160);
  assert.deepEqual(position(0.07 * REACH, 0), [0, 0]);
  assert.ok(position(0, -0.5 * REACH)[1] < 0.35);
  assert.ok(Math.abs(position(0, -REACH)[1] - 1) < 1e-9);
  assert.ok(Math.abs(Math.hypot(...position(300, 400)) - 1) < 1e-9);
  for (let way = 0, before = -1; way <= 1.2 * REACH; way += 1) {
    const now = position(way, 0)[0];
    assert.ok(now >= before);
    before = now;
  }
});

const pad = (axes, ...down) => ({axes, buttons: Array.from({length: 17}, (_, number) => (
  {pressed: down.includes(number), value: Number(down.includes(number))}))});

test("a gamepad that does not change is gone, and any change brings it back", () => {
  const one = new Pad();
  one.look(pad([0, 0, 0], 4), 0);
  assert.equal(one.look(pad([0, -1, 0], 4), 10).ahead, 1);
  assert.equal(one.look(pad([0, -1, 0], 4), 9 + STILL).ahead, 1);
  const gone = one.look(pad([0, -1, 0], 4), 10 + STILL);
  assert.deepEqual([gone.ahead, gone.gone], [0, true]);
  assert.deepEqual([one.look(pad([0, -1, 0], 4), 99999).ahead, one.look(pad([0, -0.99, 0], 4), 99999).gone], [0, false]);
  assert.ok(one.look(pad([0, -0.98, 0], 4), 99999).ahead > 0.9);
  assert.equal(one.look(pad([0, -0.98, 0]), 99999).ahead, 0);
  assert.equal(one.look(pad([0, -0.98, 0], 4), 99999).ahead, 0); // deflected before the button
  assert.ok(one.look(pad([0, 0, 0], 1), 99999).stop);
  one.look(pad([0, 0, 0], 4), 99999);
  const half = one.look(pad([0, -0.56, 0], 4), 99999).ahead; // as soft as a thumb's
  assert.ok(half > 0.2 && half < 0.3);
});

test("of two gamepads each stops, and one drives on while the other is gone", () => {
  const both = new Pads();
  const look = (first, second, now) => both.look([first, second].filter(Boolean).map((one, index) => (
    {...one, index: index + !first})), now);
  look(pad([0, 0, 0], 4), pad([0, 0, 0], 4), 0);
  assert.equal(look(pad([0, -1, 0], 4), pad([0, 0, 0], 4), 10).ahead, 1);
  const {gone, ahead} = look(pad([0, -1, 0], 4), pad([0, 1, 0], 4), 10 + STILL);
  assert.deepEqual([gone, ahead], [true, -1]);
  assert.deepEqual([1, 2].map(() => look(pad([0, -1, 0], 4), pad([0, 0, 0], 1), 20 + STILL).stop), [true, false]);
  both.letGo();
  assert.equal(look(null, pad([0, 1, 0], 4), 30 + STILL).ahead, 0);
  look(null, pad([0, 0, 0], 4), 30 + STILL);
  assert.equal(look(null, pad([0, 1, 0], 4), 30 + STILL).ahead, -1);
  assert.equal(look(pad([0, -1, 0], 4), pad([0, 0, 0], 4), 30 + STILL).ahead, 0); // it is there again, but held
  assert.deepEqual(both.look([], 99999), {ahead: 0, left: 0, turn: 0, stop: false, gone: false});
});
