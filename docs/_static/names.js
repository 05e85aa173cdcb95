// Names for a screen reader, where the theme and the gallery show none or another than is read.
document.addEventListener("DOMContentLoaded", () => {
  for (const button of document.querySelectorAll(".search-button-field")) {
    button.removeAttribute("aria-label"); // its text says more: "Search Ctrl+K"
  }
  for (const summary of document.querySelectorAll("nav summary")) {
    const entry = summary.closest("li").querySelector("a");
    summary.setAttribute("aria-label", `Pages of ${entry.textContent.trim()}`);
  }
  for (const link of document.querySelectorAll(".sphx-glr-thumbcontainer a")) {
    link.setAttribute("aria-label", link.textContent.trim());
  }
});
