/**
 * The plotting library, which the page loads as a plain script before its modules.
 * Its licence is next to it, in vendor/d3/LICENSE.
 */
export const d3 = /** @type {any} */ (globalThis).d3;
