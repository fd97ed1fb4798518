/** Work on the newest input only, one at a time, so that no old answer comes after a newer one. */

/**
 * Return a function that does the work with the newest of the inputs it is called with.
 *
 * One piece of work runs at a time. Of the inputs that come meanwhile the last one waits, the
 * others are forgotten: a point that is dragged is followed as fast as the service answers.
 *
 * @template T
 * @param {(input: T) => Promise<void>} work must not throw
 * @returns {(input: T) => void}
 */
export function latest(work) {
  let busy = false;
  /** @type {{input: T} | null} */
  let waiting = null;
  async function run() {
    busy = true;
    while (waiting) {
      const { input } = waiting;
      waiting = null;
      await work(input);
    }
    busy = false;
  }
  return (input) => {
    waiting = { input };
    if (!busy) void run();
  };
}

/**
 * Return a function that calls another one after a pause without calls.
 * @template {unknown[]} A
 * @param {number} pause_ms
 * @param {(...given: A) => void} call
 * @returns {(...given: A) => void}
 */
export function afterPause(pause_ms, call) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  return (...given) => {
    clearTimeout(timer);
    timer = setTimeout(() => call(...given), pause_ms);
  };
}
