"use strict";
// Pointing at a method shows it alone, in every chart and table of its section.
for (const section of document.querySelectorAll("section")) {
  const marks = section.querySelectorAll("[data-method]");
  const show = (method) => {
    section.classList.toggle("pointing", method !== null);
    for (const mark of marks) mark.classList.toggle("pointed", mark.dataset.method === method);
  };
  for (const mark of marks) {
    mark.addEventListener("pointerenter", () => show(mark.dataset.method));
    mark.addEventListener("pointerleave", () => show(null));
  }
}
