// SPDX-License-Identifier: MIT
import { Host, Plant as AnyPlant, PlantOptions } from "./plant.mjs";

export { PlantError } from "./plant.mjs";
export type { PlantOptions } from "./plant.mjs";

/** The WebAssembly module of this package. */
export const module: WebAssembly.Module;

/** The files of this machine. */
export const disk: Required<Host>;

/** See plant.d.mts. Here the module is found, and files are this machine's. */
export class Plant extends AnyPlant {
  static open(options?: PlantOptions): Promise<Plant>;
}
