//! How sets of eight are brought to the front, for instruction sets without a compressing store.

/// For every set of eight, the byte shuffle that brings its 16-bit elements to the front.
pub static SHUFFLES: [[u8; 16]; 256] = shuffles();

const fn shuffles() -> [[u8; 16]; 256] {
    let mut table = [[0x80; 16]; 256];
    let mut set = 0;
    while set < 256 {
        let (mut from, mut to) = (0, 0);
        while from < 8 {
            if set >> from & 1 == 1 {
                table[set][2 * to] = 2 * from as u8;
                table[set][2 * to + 1] = 2 * from as u8 + 1;
                to += 1;
            }
            from += 1;
        }
        set += 1;
    }
    table
}
