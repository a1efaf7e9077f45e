// Who moves the robot now, and what a stick would do: from what the robot itself reports. Knows no page and no clock.
const LIVE = ["can_drive", "can_stop", "can_take_it", "can_mix"];
const IMMOVABLE = ["port_missing", "port_taken", "port_forbidden", "board_silent", "board_unknown"]; // faults

// open: whether there is a connection; stalled: whether it is silent; state, status: newest, or null; page: own number.
// {who: [key of a text, name], can: key of a text, live: whether a stick moves the robot}
export function truth({open, stalled, state, status, page}) {
  const can = whatAStickDoes(open, stalled, state, status, page);
  return {who: whoMoves(open, state, page), can, live: LIVE.includes(can)};
}

function whoMoves(open, state, page) {
  if (!open || !state) {
    return ["lost", ""];
  }
  if (state.stopped) {
    return ["stopped", ""];
  }
  const [kind, name] = state.mover;
  const mine = state.driver === page;
  if (kind === "page") {
    return [mine ? "who_you" : "who_other", ""];
  }
  if (kind === "hand") {
    return /keyboard/.test(name) ? ["who_keys", ""] : /joy/.test(name) ? ["who_gamepad", ""] : ["who_hand", name];
  }
  if (kind !== "nobody") {
    return [`who_${kind}`, kind === "navigation" ? "" : name];
  }
  return [state.driver === null ? "who_nobody" : mine ? "who_yours" : "who_others", ""];
}

function whatAStickDoes(open, stalled, state, status, page) {
  if (!open || !state) {
    return "can_nothing";
  }
  if (stalled) {
    return "can_wait";
  }
  if (state.stopped) {
    return "can_release";
  }
  if (state.driver !== null && state.driver !== page) {
    return "can_take_over";
  }
  if (!state.heard) {
    return "can_no_mux";
  }
  if (status?.lights.some((light) => light.level === 2 && IMMOVABLE.includes(light.key))) {
    return "can_no_board";
  }
  if (state.held.includes(page)) {
    return "can_let_go";
  }
  return {page: "can_stop", navigation: "can_take_it", program: state.driven_by === "default" ? "can_take_it" : "can_mix"}[state.mover[0]]
    || "can_drive";
}

// The light that a person should look at, or null; `told`: names of tasks whose fault the page shows already
export function worst(lights, told) {
  return byWorst(lights.filter((light) => light.level > 0 && !told.test(light.name)))[0] || null;
}

// Lights, the worst first: an error, silence, a warning
export function byWorst(lights) {
  const rank = [0, 1, 3, 2];
  return [...lights].sort((one, other) => (rank[other.level] ?? 3) - (rank[one.level] ?? 3));
}
