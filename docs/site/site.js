/* Pages from a disk cannot fetch one another: results of a search have summaries where a server sends the pages. */
DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = location.protocol !== "file:";

/* What a reader types of a block: commands behind the prompt `$` without their answers, where it has some, else all of it. */
function typed(text) {
  const commands = [...text.matchAll(/^\$ ((?:.*\\\n)*.*)$/gm)].map((found) => found[1]);
  return commands.length ? commands.join("\n") : text.trimEnd();
}

addEventListener("DOMContentLoaded", () => {
  for (const block of document.querySelectorAll("article div.highlight")) {
    const button = document.createElement("button");
    button.className = "copy";
    button.type = "button";
    button.textContent = "Copy";
    button.addEventListener("click", async () => {
      const code = block.querySelector("pre");
      try {
        await navigator.clipboard.writeText(typed(code.textContent));
        button.textContent = "Copied";
      } catch {
        getSelection().selectAllChildren(code); // a browser that does not let pages write leaves one key to press
        button.textContent = "Ctrl+C";
      }
      setTimeout(() => (button.textContent = "Copy"), 2000);
    });
    block.append(button);
  }
});
