/** The point on the chart: dragged by mouse, pen or finger, moved by keys. */

/** Ratio by which an arrow key changes a value, and the same with Shift. */
const STEP = 1.02;
const LONG_STEP = 1.1;

const ARROWS = {
  ArrowRight: [1, 0],
  ArrowLeft: [-1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

/**
 * Let a point be moved.
 * @param {SVGGElement} point the element that is focused and dragged
 * @param {SVGElement} area the plot, on which a click moves the point
 * @param {() => ((at: [number, number]) => void)} toPlace gives what is called with a place in
 *   pixels of the sheet
 * @param {(byRatio: [number, number]) => void} onKeys called with the ratios by which a key
 *   changes x and y
 * @param {(is: boolean) => void} dragged called when the point is taken and when it is let go
 */
export function movable(point, area, toPlace, onKeys, dragged) {
  const placeOf = (/** @type {MouseEvent} */ event) => {
    const box = /** @type {SVGElement} */ (point.ownerSVGElement).getBoundingClientRect();
    return /** @type {[number, number]} */ ([event.clientX - box.left, event.clientY - box.top]);
  };
  point.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    point.setPointerCapture(event.pointerId);
    dragged(true);
    point.focus({ preventScroll: true });
    event.preventDefault();
  });
  point.addEventListener("lostpointercapture", () => dragged(false));
  // a finger on the point moves it, not the page; CSS cannot say so for a part of a drawing
  point.addEventListener("touchstart", (event) => event.preventDefault(), { passive: false });
  point.addEventListener("pointermove", (event) => {
    if (point.hasPointerCapture(event.pointerId)) toPlace()(placeOf(event));
  });
  point.addEventListener("keydown", (event) => {
    const way = ARROWS[/** @type {keyof typeof ARROWS} */ (event.key)];
    if (!way || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    const step = event.shiftKey ? LONG_STEP : STEP;
    onKeys([step ** way[0], step ** way[1]]);
  });
  area.addEventListener("click", (event) => toPlace()(placeOf(event)));
}
