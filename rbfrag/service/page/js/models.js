/** The fitted models of the service, and the choice among them. */

import { byId } from "./page.js";
import { askModels } from "./service.js";

/** A model of this term needs the record itself, which /v1/predict is not given here. */
const NEEDS_RECORD = "xp";

/** @type {any[]} */
let models = [];
let kind = "";

/**
 * Offer the models of another kind.
 * @param {string} asked its name
 */
export function offerModelsOf(asked) {
  const before = kind;
  kind = asked;
  if (kind !== before) offer();
}

/**
 * The model of a name; the list is asked again where it does not hold it.
 * @param {string} name
 * @returns {Promise<any>} undefined if there is none
 */
export async function modelNamed(name) {
  const find = () => models.find((each) => each.name === name);
  if (!find()) {
    models = await askModels();
    offer();
  }
  return find();
}

/** Offer the models in the form; what is chosen stays chosen, even if it is gone. */
function offer() {
  const select = /** @type {HTMLSelectElement} */ (byId("model"));
  const chosen = select.value;
  const [best] = select.options;
  const others = models
    .filter((each) => each.kind === kind && each.term !== NEEDS_RECORD)
    .map((each) => new Option(`${each.name}${each.is_default ? " (default)" : ""}`, each.name));
  select.replaceChildren(best, ...others);
  if (chosen && !others.some((each) => each.value === chosen)) {
    select.add(new Option(chosen, chosen));
  }
  select.value = chosen;
}
