/** Styles of a shadow root: as a sheet, which content policies allow, or as an element in browsers that make no sheets. */

/** Adds styles. @param {ShadowRoot} root @param {string} text @returns {() => void} removes them */
export function addStyle(root, text) {
  try {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(text);
    root.adoptedStyleSheets = [...root.adoptedStyleSheets, sheet];
    return () => (root.adoptedStyleSheets = root.adoptedStyleSheets.filter((each) => each !== sheet));
  } catch {
    const style = document.createElement("style");
    style.textContent = text;
    root.append(style);
    return () => style.remove();
  }
}
