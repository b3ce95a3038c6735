mod method;
mod rivals;

fn main() {}
