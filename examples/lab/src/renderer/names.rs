//! What the names of materials, meshes, nodes and joints say: what is skin, and where the face is.
//!
//! The words are those of MakeHuman, Mixamo, Ready Player Me, VRoid, DAZ, Character Creator and Blender.

/// Skin, each word whole.
const SKIN: &str = "skin face head neck body torso chest abdomen arm hand finger leg foot feet toe limb ear nose \
    nostril lip cheek chin forehead eyelid nail fingernail toenail flesh complexion caucasian asian african";
/// No skin, each word whole.
const OTHER: &str = "brow hat bag belt ring top bottom gum fur wig iris horn tie bra prop gun";
/// No skin, words that start or end so: `eyelashes`, `headwear`, `casualsuit`.
const OTHER_PARTS: &str = "eye teeth tooth denture tongue hair lash beard mustache moustache stubble glass lens \
    cornea pupil sclera tear moisture saliva cloth outfit suit shirt pant trouser jean short dress skirt coat \
    jacket vest sweater hood sock stocking shoe boot sneaker sandal glove helmet jewel earring necklace bracelet \
    watch piercing wear metal leather fabric armor armour accessor weapon sword button shadow floor";
/// What lies on a face.
const FEATURES: &str = "eye eyeball brow eyebrow lash eyelash iris cornea pupil sclera teeth tongue";

/// The words of a name in lower case: `N00_000_EyeIris.001` is n, eye, iris.
fn words(name: &str) -> impl Iterator<Item = String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        if !c.is_alphabetic() || c.is_uppercase() && before.is_lowercase() {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut().filter(|_| c.is_alphabetic()) {
            word.extend(c.to_lowercase());
        }
        before = c;
    }
    words.into_iter().filter(|word| !word.is_empty())
}

fn is_one_of(word: &str, list: &str) -> bool {
    let mut words = list.split_whitespace();
    words.any(|w| word == w || word.strip_suffix('s').is_some_and(|word| word == w))
}

/// The word for which a name is skin's.
pub(super) fn skin(name: &str) -> Option<String> {
    words(name).find(|word| is_one_of(word, SKIN))
}

/// The word for which a name is something else's.
pub(super) fn not_skin(name: &str) -> Option<String> {
    let part = |word: &str, part: &str| word.starts_with(part) || word.ends_with(part);
    words(name).find(|word| {
        let parts = OTHER_PARTS.split_whitespace();
        !is_one_of(word, SKIN) && (is_one_of(word, OTHER) || parts.clone().any(|p| part(word, p)))
    })
}

/// Whether it is a head's, as a whole.
pub(super) fn is_head(name: &str) -> bool {
    words(name).any(|word| is_one_of(&word, "head face"))
}

/// Whether it is an eye's.
pub(super) fn is_eye(name: &str) -> bool {
    words(name).any(|word| is_one_of(&word, "eye eyeball"))
}

/// Whether it is something's that lies on a face.
pub(super) fn is_feature(name: &str) -> bool {
    words(name).any(|word| is_one_of(&word, FEATURES))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As a material and its mesh are asked: skin, if nothing else.
    fn is_skin(name: &str) -> bool {
        not_skin(name).is_none() && skin(name).is_some()
    }

    #[test]
    fn names_of_tools_tell_skin_from_the_rest() {
        let skin = "Wolf3D_Skin Wolf3D_Body Wolf3D_Head Std_Skin_Head Std_Nails Ch03_Body Face Lips Ears Torso \
            N00_000_00_Face_00_SKIN N00_000_00_Body_00_SKIN young_caucasian_female head_neck_mouth neck_cap \
            Genesis8Female_Arms Fingernails SKIN skin.001 BodySkin Eyelids body_dark_brown";
        let rest = "Wolf3D_Eye Wolf3D_Teeth Wolf3D_Hair Wolf3D_Outfit_Top Wolf3D_Outfit_Bottom \
            Wolf3D_Outfit_Footwear Wolf3D_Headwear Wolf3D_Facewear Wolf3D_Glasses Wolf3D_Beard EyeLeft \
            Std_Eyelash Std_Cornea_R Std_Upper_Teeth Std_Tongue Std_Tearline_L Ch03_hair Ch03_Eyelashes \
            N00_000_00_EyeIris_00_EYE N00_000_00_FaceBrow_00_FACE N00_000_Hair_00_HAIR Tops_01_CLOTH \
            Human-Eyebrow001 Human-male_casualsuit01 high-poly Body_Armor Head_Hair Sclera EyeMoisture \
            earring jewelery HandBag Bodysuit Material.003";
        for name in skin.split_whitespace() {
            assert!(is_skin(name), "{name}: {:?}", not_skin(name));
        }
        for name in rest.split_whitespace() {
            assert!(!is_skin(name), "{name}");
        }
    }
}
