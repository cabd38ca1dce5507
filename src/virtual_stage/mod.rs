pub mod attire; pub mod camera; pub mod dome; pub mod effects; pub mod grid; pub mod head; pub mod material; pub mod motion; pub mod picture; pub mod shape; pub mod subject; pub mod transport;
