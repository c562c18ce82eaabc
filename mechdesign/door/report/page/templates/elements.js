"use strict";
// What the scripts of a page have in common; they begin when the page is there.
function ready(start) {
  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", () => start());
  else start();
}

function html(name, properties, ...children) {
  const element = Object.assign(document.createElement(name), properties);
  element.append(...children);
  return element;
}

// A part of a drawing.
function make(name, attributes, parent) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const key in attributes) element.setAttribute(key, attributes[key]);
  parent.append(element);
  return element;
}
