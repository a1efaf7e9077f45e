// look.mjs URL SECONDS: what Lichtblick's own client sees of a robot, as JSON, each message decoded by its schema.
import {parse} from "@foxglove/rosmsg";
import {MessageReader} from "@foxglove/rosmsg-serialization";
import protocol from "@foxglove/ws-protocol";
import WebSocket from "ws";

const {FoxgloveClient} = protocol;
const [url, seconds] = process.argv.slice(2);
const client = new FoxgloveClient({ws: new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL])});
const seen = {server: null, topics: {}, errors: [], description: ""};
const readers = new Map();
client.on("error", (error) => seen.errors.push(String(error.message ?? error)));
client.on("serverInfo", (info) => {
  seen.server = info;
  client.getParameters(["/robot_description"], "1");
});
client.on("parameterValues", ({parameters}) => (seen.description = parameters[0]?.value ?? ""));
client.on("advertise", (channels) => {
  for (const {id, topic, schema, schemaName} of channels) {
    readers.set(client.subscribe(id), {topic, reader: new MessageReader(parse(schema))});
    seen.topics[topic] = {type: schemaName, messages: 0, newest: null};
  }
});
client.on("message", ({subscriptionId, data}) => {
  const {topic, reader} = readers.get(subscriptionId);
  seen.topics[topic].messages += 1;
  seen.topics[topic].newest = reader.readMessage(data);
});
setTimeout(() => {
  console.log(JSON.stringify(seen, (_, value) => ArrayBuffer.isView(value) ? [...value].slice(0, 4) :
    typeof value === "bigint" ? String(value) : value));
  process.exit(0);
}, 1000 * seconds);
