// Types for tools/check_page.py: what the page takes of three.
export * from "../../../../../../tools/page/three_entry.js";
