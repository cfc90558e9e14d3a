import "./style.css";

import { App } from "./view/app";

const scheme = location.protocol === "https:" ? "wss:" : "ws:";
new App(`${scheme}//${location.host}/`);
